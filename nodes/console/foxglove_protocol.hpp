/// \file
/// The Foxglove WebSocket protocol, version 1, as values: what a client's frames ask, and the
/// server's frames. Sources: foxglove/ws-protocol's docs/spec.md; playback control: foxglove-sdk's
/// rust/foxglove/src/protocol.
///
/// One client of the Foxglove WebSocket protocol: its subscriptions, and the answers that are the
/// same whether its messages are live or stored.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "nodes/console/http_message.hpp"
#include "replay/messages/message.hpp"

namespace afterglow::nodes {

/// The subprotocol's names. Clients of the older one know no playback control: its frames are
/// errors to them.
constexpr const char* kFoxgloveSdk = "foxglove.sdk.v1";
constexpr const char* kFoxgloveWebSocket = "foxglove.websocket.v1";

/// A topic of one type.
struct FoxgloveChannel {
  std::uint32_t id = 0;
  std::string topic;
  std::string type;
  std::string definition;  ///< full text, with the definitions of all contained types
  std::string md5;         ///< of the type; clients are not told
};

struct FoxgloveSubscription {
  std::uint32_t id = 0;  ///< chosen by the client
  std::uint32_t channel = 0;
};

// ---------------------------------------------------------------------------------- from a client

struct SubscribeRequest {
  std::vector<FoxgloveSubscription> subscriptions;
};

struct UnsubscribeRequest {
  std::vector<std::uint32_t> ids;
};

struct ParametersRequest {
  std::vector<std::string> names;  ///< empty: all
  std::string id;                  ///< the answer's; empty: none
  bool sets = false;               ///< the client would change them
};

struct PlaybackRequest {
  bool plays = false;  ///< false: pauses
  double speed = 1;
  std::optional<replay::Stamp> seek;
  std::string id;  ///< the answer's
};

/// A frame that asks for what there is not, or that cannot be read.
struct RefusedRequest {
  std::string why;  ///< one line
};

using FoxgloveRequest = std::variant<SubscribeRequest, UnsubscribeRequest, ParametersRequest,
                                     PlaybackRequest, RefusedRequest>;

/// Reads whatever a client sends.
FoxgloveRequest readFoxglove(const SocketFrame& frame);

// ------------------------------------------------------------------------------------ to a client

enum class FoxgloveLevel { Info, Warning, Error };

using FoxgloveParameters = std::map<std::string, nlohmann::json>;

struct FoxgloveServerInfo {
  std::string name;
  std::vector<std::string> capabilities;
  /// The interval that can be played.
  std::optional<std::pair<replay::Stamp, replay::Stamp>> range;
};

struct PlaybackState {
  enum class Status : std::uint8_t { Playing, Paused, Buffering, Ended } status = Status::Paused;
  replay::Stamp at;
  double speed = 1;
  bool has_sought = false;  ///< what was shown is not true any longer
  std::string id;           ///< the request's; empty: nobody asked
};

SocketFrame serverInfoFrame(const FoxgloveServerInfo& info);
SocketFrame advertiseFrame(const std::vector<FoxgloveChannel>& channels);
SocketFrame unadvertiseFrame(const std::vector<std::uint32_t>& channels);
SocketFrame statusFrame(FoxgloveLevel level, const std::string& text);
SocketFrame parametersFrame(const FoxgloveParameters& parameters, const std::string& id);
SocketFrame timeFrame(replay::Stamp time);
SocketFrame playbackStateFrame(const PlaybackState& state);

/// A binary frame with room for a message of `size` bytes at kMessageOffset.
constexpr std::size_t kMessageOffset = 13;
std::string messageFrame(std::uint32_t subscription, replay::Stamp received, std::size_t size);

/// Reads the client's frames. Nothing that a client sends changes anything: parameters are read
/// only, publishing and services are refused.
class FoxgloveSession : public SocketService {
 public:
  void take(const SocketFrame& frame) final;

 protected:
  explicit FoxgloveSession(std::shared_ptr<FrameQueue> frames) : frames_(std::move(frames)) {}

  /// The first frames of a connection.
  void greet(const FoxgloveServerInfo& info, const std::vector<FoxgloveChannel>& channels);
  void addChannels(const std::vector<FoxgloveChannel>& channels);
  /// Their subscriptions end.
  void removeChannels(const std::vector<std::uint32_t>& channels);
  void say(FoxgloveLevel level, const std::string& text) {
    frames_->push(statusFrame(level, text));
  }
  FrameQueue& frames() { return *frames_; }

 private:
  // Each is called where the rules allow it, one after the other.
  virtual void begin(const FoxgloveSubscription& subscription, const FoxgloveChannel& channel) = 0;
  /// All of a request have begun.
  virtual void begun() {}
  virtual void end(std::uint32_t subscription) = 0;
  virtual FoxgloveParameters parameters() = 0;
  /// Throws std::runtime_error, one line.
  virtual void control(const PlaybackRequest& request);

  void answer(const SubscribeRequest& request);
  void answer(const UnsubscribeRequest& request);
  void answer(const ParametersRequest& request);
  void answer(const PlaybackRequest& request) { control(request); }
  void answer(const RefusedRequest& request);
  void add(const FoxgloveSubscription& subscription);

  const std::shared_ptr<FrameQueue> frames_;
  std::mutex mutex_;
  std::map<std::uint32_t, FoxgloveChannel> channels_;
  std::map<std::uint32_t, std::uint32_t> subscriptions_;  ///< channels by subscription
};

}  // namespace afterglow::nodes

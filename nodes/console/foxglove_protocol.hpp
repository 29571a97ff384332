/// \file
/// The Foxglove WebSocket protocol, version 1, as values: what a client's frames ask, and the
/// server's frames. Sources: foxglove/ws-protocol's docs/spec.md; playback control: foxglove-sdk's
/// rust/foxglove/src/protocol.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "nodes/console/web_socket.hpp"
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

}  // namespace afterglow::nodes

/// \file
/// One client of the Foxglove WebSocket protocol: its subscriptions, and the answers that are the
/// same whether its messages are live or stored.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "nodes/console/foxglove_protocol.hpp"

namespace afterglow::nodes {

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

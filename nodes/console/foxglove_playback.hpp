/// \file
/// A stored behavior over the Foxglove WebSocket protocol: played on a timeline of the client's
/// own, with pause, speed and seek.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "nodes/console/foxglove_protocol.hpp"
#include "replay/clock/timeline.hpp"
#include "replay/play/message_lanes.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct PlaybackStart {
  double t = 0;  ///< seconds since the behavior's begin
  double rate = 1;
  bool has_controls = true;  ///< the client knows them
};

/// Plays from the first subscription on, by itself; at the end it stands. A client that takes its
/// frames slowly is waited for. Whoever subscribes gets first what is in force there: the last
/// message of each latching publisher, the markers that are shown, transforms of the last second,
/// the newest message of other topics; after a seek all subscriptions do.
class FoxglovePlayback final : public FoxgloveSession {
 public:
  /// The store has to outlive it. Throws replay::StoreError, and std::runtime_error for a rate that
  /// cannot be.
  FoxglovePlayback(const replay::Store& store, replay::Behavior behavior,
                   std::shared_ptr<FrameQueue> frames, const PlaybackStart& start);
  ~FoxglovePlayback() override;

 private:
  using SteadyPoint = std::chrono::steady_clock::time_point;

  /// A topic of the behavior, as it is announced.
  struct Topic {
    FoxgloveChannel channel;
    bool is_latched = false;
  };
  struct Orders {
    std::map<std::uint32_t, std::string> begins;  ///< topics by subscription
    std::vector<std::uint32_t> ends;
    std::vector<PlaybackRequest> controls;
  };
  /// A place in the total order of messages.
  using Place = std::pair<std::int64_t, std::uint64_t>;

  // The client's requests, from any thread.
  void begin(const FoxgloveSubscription& subscription, const FoxgloveChannel& channel) override;
  void begun() override { changed_.notify_all(); }
  void end(std::uint32_t subscription) override;
  FoxgloveParameters parameters() override;
  void control(const PlaybackRequest& request) override;

  void readTopics();
  // The playing thread.
  void run();
  void obey(const Orders& orders);
  bool apply(const PlaybackRequest& request);
  void moveTo(replay::Stamp moment);
  void settle();
  void sendState(const std::string& topic, std::uint32_t subscription);
  std::vector<replay::Message> stateOf(const Topic& topic);
  void openReader();
  SteadyPoint playOn();
  void sendDue(const replay::Message& message);
  void send(const replay::Message& message, std::uint32_t subscription, replay::Stamp received);
  void sendTime(replay::Stamp time);
  void tell(bool has_sought = false, const std::string& id = "");
  const replay::Channel& channelOf(std::int64_t id);

  const replay::Store& store_;
  const replay::Behavior behavior_;
  const bool has_controls_;
  replay::Stamp end_;  ///< the last moment that is played
  std::map<std::string, Topic> topics_;

  // Of the playing thread, once it runs.
  std::map<std::string, std::uint32_t> subscriptions_;  ///< by topic
  std::map<std::int64_t, replay::Channel> channels_;
  replay::Timeline timeline_;
  Place next_;  ///< what was before it has been sent
  std::unique_ptr<replay::Prefetch> reader_;
  replay::Stamp told_;  ///< the last time that was sent
  bool is_paused_ = false, is_stalled_ = false, has_begun_ = false, has_ended_ = false;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Orders> orders_;
  bool is_ending_ = false;
  std::thread thread_;  ///< last: it uses all of the above
};

}  // namespace afterglow::nodes

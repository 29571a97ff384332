/// \file
/// A replay that waits for a consumer of its messages.
/// Source of the semantics: rosbag play's --rate-control-topic and --rate-control-max-delay.
#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "nodes/conversion/typed_message.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "replay/messages/schema.hpp"
#include "replay/play/consumer_lag.hpp"
#include "replay/play/outbox.hpp"

namespace afterglow::nodes {

struct RateControlOptions {
  std::string topic;  ///< topic of messages that begin with a header; empty: nobody is waited for
  double longest_delay_s = 1;  ///< delay of recorded time
};

/// Sits before the sink that messages go to. After a message that is further ahead of the topic's
/// last header than the longest delay, the replay is held until the topic has come closer.
class RateControl : public replay::MessageSink {
 public:
  /// The replay as the rate control sees and commands it, from any thread.
  struct Replay {
    std::function<replay::Stamp()> position;  ///< the recorded moment that is played
    std::function<replay::Stamp()> now;       ///< ROS time
    std::function<void(bool)> hold;
    std::function<void(const std::string&)> stop;
  };
  RateControl(const RateControlOptions& options, const replay::PlayPlan& plan,
              bool has_recorded_time, replay::MessageSink& next, Replay replay);

  bool publish(const replay::Channel& channel, const replay::Bytes& bytes) override;

 private:
  using Answer = ros::MessageEvent<const RawMessage>;
  void onAnswer(const Answer& answer);
  void follow(const std::function<void()>& change);

  const std::string topic_;
  replay::MessageSink& next_;
  const Replay replay_;
  std::mutex mutex_;
  replay::ConsumerLag lag_;
  bool is_held_ = false;
  std::optional<replay::Schema> schema_;  ///< schema of the answers
  CallbackThread thread_;
};

}  // namespace afterglow::nodes

/// \file
/// Publishes recorded messages on ROS topics, whatever their type, and watches the action servers
/// that receive goals.
///
/// A replay that waits for a consumer of its messages.
/// Source of the semantics: rosbag play's --rate-control-topic and --rate-control-max-delay.
#pragma once

#include <actionlib_msgs/GoalStatusArray.h>

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/conversion/typed_message.hpp"
#include "nodes/tools/callback_thread.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/messages/schema.hpp"
#include "replay/motion/milestones.hpp"
#include "replay/play/consumer_lag.hpp"
#include "replay/play/outbox.hpp"

namespace afterglow::nodes {

class RosSink : public replay::MessageSink {
 public:
  /// Called in a thread of the sink's own.
  struct Listener {
    std::function<void(const std::string& goal_id, const replay::GoalEnd& end)> on_goal_status;
    /// Another node has sent a velocity on a topic that is played; said once.
    std::function<void(const std::string& driver)> on_second_driver;
  };

  /// Advertises every topic that is played under the name it is published by, with its stored
  /// definition and latching, and the topics of what stops it.
  RosSink(const replay::PlayPlan& plan, std::uint32_t queue, Listener listener);

  /// Waits until every topic that is played has a subscriber, and those that the master names are
  /// connected; gives up at the deadline or when `is_stopped`. Returns the topics nobody hears.
  std::vector<std::string> waitForSubscribers(Deadline deadline,
                                              const std::function<bool()>& is_stopped);

  /// Listens for a moment on the velocity topics: on_second_driver is called before this returns if
  /// somebody drives. A node that only might (it advertises) is left alone.
  void listenForDrivers();

  /// Any thread. Throws std::logic_error for a topic that was not planned.
  bool publish(const replay::Channel& channel, const replay::Bytes& bytes) override;

 private:
  struct Output {
    /// Publishers by whether they latch and, if so, who sent: each latched message of theirs is
    /// kept for who subscribes later. Their connections to subscribers are common.
    std::map<std::pair<bool, std::string>, ros::Publisher> publishers;
    topic_tools::ShapeShifter message;
    std::size_t own_subscribers = 0;  ///< this sink's own subscribers, to hear other drivers
    std::size_t heardBy() const {
      return publishers.begin()->second.getNumSubscribers() - own_subscribers;
    }
  };

  Output& advertise(const replay::Channel& channel);
  ros::Publisher& publisherOf(Output& output, const replay::Channel& channel);
  void watchGoals(const replay::Channel& goal_channel);
  void watchDrivers(const std::string& topic, Output& output);
  void onStatus(const actionlib_msgs::GoalStatusArray& statuses);
  void onResult(const AnyMessage& event);

  ros::NodeHandle node_;
  std::map<std::string, Output> outputs_;
  std::mutex publishing_;  ///< an output's message is one
  const std::uint32_t queue_size_;
  std::vector<std::string> played_;
  std::vector<std::string> velocities_;
  const Listener listener_;
  std::atomic<bool> has_second_driver_{false};
  /// Has no thread, as one would wake for each velocity of the player's own and make the next message
  /// late; `thread_` looks after it.
  CallbackThread drivers_;
  CallbackThread thread_;
};

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

/// \file
/// The topics of an action on ROS 1.
#pragma once

#include <ros/ros.h>

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "nodes/conversion/typed_message.hpp"
#include "replay/clock/worker_thread.hpp"
#include "replay/messages/definitions.hpp"
#include "replay/messages/message.hpp"
#include "replay/ros2/action_messages.hpp"

namespace afterglow::nodes {

/// actionlib's topics of one action, and the thread in which all that has to do with the action
/// happens, one after the other. Destroyed by another thread than that one.
class ActionOnRos1 {
 public:
  using Task = std::function<void(replay::Stamp now)>;
  using Take = std::function<void(const replay::Bytes& ros1, replay::Stamp now)>;
  static constexpr std::size_t kMostWaiting = 1000;

  /// `action`: "/fibonacci".
  explicit ActionOnRos1(std::string action);
  ~ActionOnRos1() { deafen(); }

  /// Does it in the thread, unless so many wait. What it throws of std::runtime_error is logged.
  void post(Task task, std::size_t most_waiting = kMostWaiting);
  /// From now on kActionTicksPerSecond times.
  void postTicks(const Task& task);
  /// Hears no message more, and ticks no more.
  void deafen();

  // `channel`: the topic's type; its name is not used.
  void advertise(replay::ActionTopic topic, const replay::Channel& channel);
  /// `take` is called in the thread for what other nodes publish.
  void subscribe(replay::ActionTopic topic, const replay::Channel& channel, const Take& take);
  /// Nothing while the topic is not advertised.
  void publish(replay::ActionTopic topic, const replay::Bytes& ros1) const;
  bool isSubscribed() const { return !subscribers_.empty(); }
  /// Whether another node is connected to each of the topics.
  bool isMet() const;

  // Types that all actions have.
  static const replay::Channel& cancel();
  static const replay::Channel& status();

 private:
  using Event = ros::MessageEvent<RawMessage>;

  const std::string action_;
  ros::NodeHandle node_;
  std::map<replay::ActionTopic, ros::Publisher> publishers_;
  replay::TaskThread thread_{kMostWaiting};
  std::vector<ros::Subscriber> subscribers_;  ///< these and the next post to `thread_`
  ros::SteadyTimer timer_;
};

}  // namespace afterglow::nodes

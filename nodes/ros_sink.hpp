/// \file
/// Publishes recorded messages on ROS topics, whatever their type, and watches the action servers
/// that receive goals.
#pragma once

#include <actionlib_msgs/GoalStatusArray.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <topic_tools/shape_shifter.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "nodes/ros_graph.hpp"
#include "replay/player.hpp"

namespace afterglow::nodes {

class RosSink : public replay::MessageSink {
 public:
  /// Called in a thread of the sink's own.
  using OnGoalStatus = std::function<void(const std::string& goal_id, std::uint8_t status)>;

  /// Advertises every topic that is played, with its stored definition and latching, and the cancel
  /// topics of its actions.
  RosSink(const replay::PlayPlan& plan, OnGoalStatus on_goal_status);
  ~RosSink() override;
  RosSink(const RosSink&) = delete;
  RosSink& operator=(const RosSink&) = delete;

  /// Waits until every topic that is played has a subscriber, and those that the master names are
  /// connected; gives up at the deadline or when `is_stopped`. Returns the topics nobody hears.
  std::vector<std::string> waitForSubscribers(Deadline deadline,
                                              const std::function<bool()>& is_stopped);

  /// The scheduler's thread. Throws std::logic_error for a topic that was not planned.
  bool publish(const replay::Channel& channel, const replay::Bytes& bytes) override;

 private:
  struct Output {
    ros::Publisher publisher;
    topic_tools::ShapeShifter message;
  };
  void advertise(const replay::Channel& channel);
  void watch(const replay::Channel& goal_channel);
  void onStatus(const actionlib_msgs::GoalStatusArray& statuses);

  ros::NodeHandle node_;
  std::map<std::string, Output> outputs_;
  std::vector<std::string> played_;
  const OnGoalStatus on_goal_status_;
  ros::CallbackQueue queue_;
  std::vector<ros::Subscriber> statuses_;
  ros::AsyncSpinner spinner_;
};

}  // namespace afterglow::nodes

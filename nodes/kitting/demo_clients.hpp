/// \file
/// The demo's calls to recorder_node and ask_node. Every method may throw
/// TaskError, one line that names who did not do what; all need a running spinner.
///
/// Sends goals of an action, whatever its type, and hears on its status topic how they end:
/// compiled once, where actionlib's client is compiled for every type.
#pragma once

#include <actionlib_msgs/GoalStatusArray.h>
#include <afterglow/AskActionResult.h>
#include <afterglow/ReplayActionFeedback.h>
#include <afterglow/ReplayActionResult.h>
#include <afterglow/StopRecording.h>
#include <ros/ros.h>

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>


namespace afterglow::nodes {

/// The demo cannot go on; the text says why, in one line.
class TaskError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Sleeps in ROS time; not at all if `seconds` is not positive. Throws TaskError if ROS ends.
void sleepFor(double seconds);
/// Waits until the condition holds; false if it does not in so many seconds. Throws as sleepFor().
bool waitUntil(const std::function<bool()>& condition, double seconds);

/// A client of one goal at a time: a new one takes the place of the one before. Needs a running
/// spinner.
class ActionClient {
 public:
  /// Makes a client; `who` is the server, for people: "the arm".
  template <typename ActionGoal>
  static ActionClient of(const std::string& who, const std::string& action) {
    return {who, action, ros::NodeHandle().advertise<ActionGoal>(action + "/goal", 5)};
  }

  bool isServed() const;
  const std::string& who() const { return who_; }
  /// Takes the publisher off the graph: nothing is sent any more.
  void leave() { goals_.shutdown(); }

  /// `Goal` is the action's goal message, `ActionGoal` the one on the topic.
  template <typename ActionGoal, typename Goal>
  void send(const Goal& goal) {
    ActionGoal message;
    message.goal = goal;
    message.header.stamp = message.goal_id.stamp = ros::Time::now();
    message.goal_id.id = begin();
    goals_.publish(message);
  }
  /// Returns true if the goal sent last has ended, well or not.
  bool isOver() const;
  /// Throws TaskError if the goal has not succeeded within so many seconds.
  void expectSuccess(double seconds) const;

 private:
  ActionClient(std::string who, const std::string& action, const ros::Publisher& goals);
  std::string begin();
  void onStatus(const actionlib_msgs::GoalStatusArray& statuses);
  actionlib_msgs::GoalStatus status() const;

  std::string who_;
  ros::Publisher goals_;
  std::function<std::string()> fresh_id_;
  mutable std::mutex mutex_;
  actionlib_msgs::GoalStatus status_;  ///< status of the goal sent last
  ros::Subscriber statuses_;
};

/// Runs `behavior` between the recorder's "everything is subscribed" and its end, with outcome
/// "success"; with "failure" if it throws, which is thrown on.
StopRecordingResponse recordBehavior(const std::string& name,
                                     const std::vector<std::string>& topics,
                                     const std::function<void()>& behavior);

/// Asks the robot as a person does, by ask_node, and watches how player_node answers.
class AskClient {
 public:
  AskClient();
  void waitUntilReady(double seconds);
  /// The replay that answered, of a behavior of so many seconds, with its motion: another answer is
  /// an error. `on_position` is called often with the seconds into the behavior, once the player
  /// has begun.
  ReplayResult ask(const std::string& question, double duration_s,
                   const std::function<void(double)>& on_position);

 private:
  void forget();
  bool isAnswered(const std::function<void(double)>& on_position);

  ActionClient client_;
  std::mutex mutex_;
  std::optional<double> position_s_;  ///< position told last: it stands while the replay waits
  std::optional<AskResult> answer_;
  std::optional<ReplayActionResult> replay_;
  ros::Subscriber feedback_, answers_, replays_;
};

/// Whoever died on the way took part of the demo with them.
void expectAllNodes();

}  // namespace afterglow::nodes

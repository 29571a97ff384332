/// \file
/// An emergency stop that is published on a topic (std_msgs/Bool, true: stop), latched or repeated.
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_msgs/Bool.h>

#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {

struct EmergencyStopOptions {
  std::string topic;  ///< empty: there is none
  /// s; above 0 the topic has to be repeated at least this often: silence stops the robot.
  double longest_silence_s = 0;
};

/// Listens in a thread of its own.
class EmergencyStop {
 public:
  /// `on_stop` is called once, with the reason, when the robot has to stop.
  EmergencyStop(const EmergencyStopOptions& options,
                std::function<void(const std::string& reason)> on_stop);
  ~EmergencyStop();
  EmergencyStop(const EmergencyStop&) = delete;
  EmergencyStop& operator=(const EmergencyStop&) = delete;

  /// Waits for the first message if the topic has a publisher, or has to be repeated. Throws
  /// std::runtime_error, one line, if the robot may not move.
  void check();

 private:
  void onWord(bool is_pressed);
  void onTimer();
  void stop(const std::string& reason);

  const EmergencyStopOptions options_;
  const std::function<void(const std::string&)> on_stop_;
  std::mutex mutex_;
  std::optional<Deadline> heard_;
  bool is_pressed_ = false, has_stopped_ = false, is_checked_ = false;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  ros::WallTimer timer_;
  ros::AsyncSpinner spinner_;
};

}  // namespace afterglow::nodes

/// \file
/// The console's link to calibrator_node: hears its state, and asks for its steps.
#pragma once

#include <ros/ros.h>
#include <std_msgs/String.h>

#include <cstddef>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

namespace afterglow::nodes {

/// Any thread.
class CalibratorLink {
 public:
  static constexpr std::size_t kMostSaid = 8;

  /// A node's name, "/calibrator_node".
  explicit CalibratorLink(const std::string& calibrator);

  /// Returns ~status and `said`: the last lines of its ~guidance, the newest first. Null: it is not
  /// there, or has said nothing yet.
  nlohmann::ordered_json state() const;

  /// Returns true if trigger() knows it: start, stop, take, solve, discard_last.
  static bool isCommand(const std::string& name);
  /// Waits for the answer, and returns its words. Throws HttpError with the calibrator's own.
  std::string trigger(const std::string& command) const;

 private:
  void onStatus(const std_msgs::String& status);
  void onGuidance(const std_msgs::String& guidance);

  const std::string calibrator_;
  mutable std::mutex mutex_;
  nlohmann::ordered_json status_;
  std::deque<std::string> said_;
  ros::NodeHandle node_;
  ros::Subscriber statuses_, guidance_;
};

}  // namespace afterglow::nodes

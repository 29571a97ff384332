/// \file
/// What calibrator_node says, and where: ~guidance, the log, /robotsound, ~status.
#pragma once

#include <ros/ros.h>

#include <string>
#include <vector>

#include "calib/guide/prompter.hpp"

namespace afterglow::nodes {

/// One thread at a time.
class CalibratorVoice {
 public:
  explicit CalibratorVoice(bool is_spoken);

  /// Written on ~guidance (std_msgs/String, latched; advice with the progress) and in the log,
  /// spoken by whoever listens to /robotsound.
  void say(const calib::Utterance& utterance, const std::string& progress);
  /// ~status (std_msgs/String holding JSON, latched), if it has changed.
  void showStatus(const std::string& json);
  /// A problem, once for as long as it lasts.
  void complain(const std::string& problem);

 private:
  const bool is_spoken_;
  ros::NodeHandle nh_, own_{"~"};
  ros::Publisher guidance_, status_, sound_;
  std::string last_status_, last_problem_;
};

}  // namespace afterglow::nodes

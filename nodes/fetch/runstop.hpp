/// \file
/// The runstop of a Fetch, simulated. The topics and what they mean: fetch_bringup's
/// software_runstop.py, fetch_driver_msgs.
#pragma once

#include <ros/ros.h>
#include <std_msgs/Bool.h>
#include <topic_tools/shape_shifter.h>

#include <cstdint>
#include <functional>
#include <mutex>

namespace afterglow::nodes {

/// The runstop of a Fetch. In: /enable_software_runstop (std_msgs/Bool: true cuts the power, false
/// gives it back). Out, ten times a second: /software_runstop_enabled (std_msgs/Bool) and
/// /robot_state, whose field runstopped says the same; of the real message it has the header and
/// the three booleans alone, so it is of a type of its own.
class Runstop {
 public:
  /// Takes `on_press`, which a callback calls when it is pressed.
  explicit Runstop(std::function<void()> on_press);

  bool isPressed();

 private:
  void onWord(bool is_pressed);
  void publish();

  const std::function<void()> on_press_;
  std::mutex mutex_;
  bool is_pressed_ = false;
  std::uint32_t sequence_ = 0;
  topic_tools::ShapeShifter state_;
  ros::NodeHandle node_;
  ros::Publisher enabled_publisher_, state_publisher_;
  ros::Subscriber subscriber_;
  ros::WallTimer timer_;
};

}  // namespace afterglow::nodes

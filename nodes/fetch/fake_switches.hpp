/// \file
/// The runstop of a Fetch, simulated. The topics and what they mean: fetch_bringup's
/// software_runstop.py, fetch_driver_msgs.
///
/// The multiplexer of a base, simulated: topic_tools' mux, as fetch_bringup's teleop.launch and
/// PR2's pr2_navigation_teleop start it. A person takes over by a service, and nothing takes that
/// back.
#pragma once

#include <geometry_msgs/Twist.h>
#include <ros/ros.h>
#include <std_msgs/Bool.h>
#include <topic_tools/MuxSelect.h>
#include <topic_tools/shape_shifter.h>

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

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

/// The multiplexer of velocities. In: velocities, by default of cmd_vel and teleop/cmd_vel; out:
/// base_controller/command, what comes on the selected one of them, and cmd_vel_mux/selected
/// (std_msgs/String, latched), which one that is, by the service cmd_vel_mux/select; all in the
/// node's namespace. Without timeout or priority.
class VelocityMux {
 public:
  explicit VelocityMux(const std::vector<std::string>& inputs = {"cmd_vel", "teleop/cmd_vel"});

  /// The output's topic, for a node that is the base, too.
  static const std::string& output();

 private:
  void select(const std::string& topic);
  bool onSelect(topic_tools::MuxSelect::Request& request,
                topic_tools::MuxSelect::Response& response);

  ros::NodeHandle node_;
  std::vector<std::string> inputs_;  ///< the first is selected at first
  std::mutex mutex_;
  std::string selected_;
  ros::Publisher output_, selected_publisher_;
  std::vector<ros::Subscriber> subscribers_;
  ros::ServiceServer service_;
};

}  // namespace afterglow::nodes

/// \file
/// The multiplexer of a base, simulated: topic_tools' mux, as fetch_bringup's teleop.launch and
/// PR2's pr2_navigation_teleop start it. A person takes over by a service, and nothing takes that
/// back.
#pragma once

#include <geometry_msgs/Twist.h>
#include <ros/ros.h>
#include <topic_tools/MuxSelect.h>

#include <mutex>
#include <string>
#include <vector>

namespace afterglow::nodes {

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

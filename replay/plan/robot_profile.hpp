/// \file
/// What is known of a robot beyond its own description: a profile, assets/robots/NAME.yaml, which
/// assets/README.md explains. Topics and frames as the robot has them; meters, radians, seconds.
#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

namespace afterglow::replay {

/// Of a default one nothing is known: texts are empty, numbers 0.
struct RobotProfile {
  std::string name;  ///< "fetch"; empty: no profile was given
  /// By class ("body", "shown", "control", "endless", "other"): the last names of topics, with *
  /// for any characters. They count before what is known of all robots.
  std::map<std::string, std::vector<std::string>> topics;
  struct Base {
    std::string velocity_topic;  ///< where a replay may enter, before the multiplexer
    std::vector<std::string> take_over_topics;  ///< velocities of people and safety devices
    std::string output_topic;  ///< behind the multiplexer: what the base really obeys
    std::string odometry_topic;
    std::string map_frame, odom_frame, base_frame;
    std::vector<std::array<double, 2>> footprint;    ///< m, in the base frame; empty: unknown
    double deceleration = 0, command_timeout_s = 0;  ///< m/s^2, s; 0: unknown
    double fastest = 0, fastest_turn = 0;            ///< m/s, rad/s; 0: unknown
    double linear_acceleration = 0, angular_acceleration = 0;  ///< m/s^2, rad/s^2; 0: unknown
    bool is_holonomic = false;                       ///< it goes sideways, too
  } base;
  /// What takes its goals or commands: actions and topics, "/arm_controller/follow_joint_trajectory".
  std::vector<std::string> controllers;
  /// Its trajectory controllers join a goal to where they have the joints by themselves.
  bool controllers_join = false;
  std::string scan_topic;
  struct EmergencyStop {
    std::string topic, field;  ///< "/robot_state", "runstopped"
    bool stops_when = true;    ///< the field's value that stops the robot
  } emergency_stop;
  std::vector<std::string> joints;  ///< all that the profile names
  /// At most, where the robot's description says nothing: rad or m, per s and s^2.
  std::map<std::string, double> joint_speeds, joint_accelerations;
  std::map<std::string, std::array<double, 2>> joint_ranges;  ///< lowest and highest position
  std::vector<std::string> gripper_joints;  ///< of a gripper's goal; the gap is their sum
  /// Of a head whose controller begins at the end of its last goal, not where it looks; empty: none
  /// such is known. Its x axis is the line of sight.
  std::string gaze_frame;
};

}  // namespace afterglow::replay

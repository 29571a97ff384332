/// \file
/// What the simulated robots are: joints, controllers, bases, multiplexers and stops of a TIAGo, a
/// PR2, a TurtleBot3 and a UR5e, as far as a player meets them. Meters, radians, seconds.
///
/// Sources, read: tiago_robot (kinetic-devel), pr2_controllers and pr2_robot, OpenCR's
/// turtlebot3_core, Universal_Robots_ROS_Driver, ros_controllers (noetic-devel), twist_mux. Ranges
/// of joints that no test comes near are wider than theirs. PAL's emergency stop is not in public
/// sources: its topic is that of the profile.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nodes/fetch/fake_laser.hpp"
#include "nodes/fetch/robot_model.hpp"
#include "tests/support/simulated_drive.hpp"

namespace afterglow::test {

struct JointFacts {
  std::string name;
  double lower, upper, speed;
  nodes::Joint::Kind kind = nodes::Joint::Kind::Revolute;
};

/// A controller of joint trajectories, with its actions and its topic `command`.
struct ControllerFacts {
  enum class Kind {
    RosControl,  ///< ros_controllers' joint_trajectory_controller
    Pr2,         ///< pr2_controllers' JointTrajectoryActionController
  };
  std::string name;
  std::vector<std::string> joints;
  Kind kind = Kind::RosControl;
  double stop_duration = 0;  ///< stop_trajectory_duration
  double path_tolerance = 0, goal_tolerance = 0, goal_time = 0;  ///< tolerances of 0: unchecked
};

struct BaseFacts {
  std::string command_topic, odometry_topic, odometry_frame, base_frame;
  DriveManners manners;
  nodes::ScanTopic scan;
  std::string echo_topic = "";  ///< where it tells what it obeys; empty: nowhere
};

/// What stands before the base, a node of its own.
struct MuxFacts {
  struct Input {
    std::string topic;
    int priority;
  };
  std::vector<Input> inputs;
  std::vector<Input> locks;  ///< of twist_mux; none: topic_tools' mux
  std::string output;
};

/// An emergency stop on a topic.
struct StopFacts {
  std::string topic, type, definition, field;
  bool stops_when = true;
  double period = 0;             ///< 0: latched, and sent on change
  bool stops_controllers = false;  ///< else the joints lose their power, and the controllers go on
};

/// PR2's, which a cancel makes limp: what it holds pulls it open.
struct GripperFacts {
  std::string action, joint;
  double widest, speed;
};

struct RobotFacts {
  std::string name;
  std::vector<JointFacts> joints;
  std::vector<ControllerFacts> controllers;
  std::optional<BaseFacts> base;
  std::optional<MuxFacts> mux;
  std::optional<StopFacts> stop;
  std::optional<GripperFacts> gripper;
  bool has_speed_scale = false;  ///< a pendant slows the controllers' time down, to 0 in a pause

  /// Its URDF: every joint is one of the base's.
  std::string description() const;
};

/// "tiago", "pr2", "turtlebot3", "ur". Throws std::out_of_range for others.
const RobotFacts& factsOf(const std::string& name);

}  // namespace afterglow::test

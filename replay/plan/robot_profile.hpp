/// \file
/// The facts about a robot beyond its own description: a profile, assets/robots/NAME.yaml, which
/// assets/README.md explains; and what that makes of its topics. Topics and frames as the robot has
/// them; meters, radians, seconds.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "replay/plan/topic_role.hpp"

namespace afterglow::replay {

using JointRange = std::array<double, 2>;  ///< the lowest and the highest position

struct JointLimits {
  std::optional<double> velocity, acceleration;  ///< rad or m, per s and s^2; empty: not known
  std::optional<JointRange> range;
};

/// A robot's profile; in a default one nothing is known: texts are empty, numbers 0.
struct RobotProfile {
  std::string name;  ///< "fetch"; empty: no profile was given
  /// The last names of topics, with * for any characters. They count before what is known of all
  /// robots.
  std::map<TopicClass, std::vector<std::string>> topics;
  struct Base {
    std::string velocity_topic;  ///< topic by which a replay may enter, before the multiplexer
    std::vector<std::string> take_over_topics;  ///< velocities of people and safety devices
    std::string output_topic;  ///< behind the multiplexer: what the base really obeys
    std::string odometry_topic;
    std::string map_frame, odom_frame, base_frame;
    std::vector<std::array<double, 2>> footprint;    ///< m, in the base frame; empty: unknown
    double deceleration = 0, command_timeout_s = 0;  ///< m/s^2, s; 0: unknown
    double fastest = 0, fastest_turn = 0;            ///< m/s, rad/s; 0: unknown
    double linear_acceleration = 0, angular_acceleration = 0;  ///< m/s^2, rad/s^2; 0: unknown
    bool is_holonomic = false;                                 ///< true: it goes sideways, too
  } base;
  /// Actions and topics that take its goals or commands: "/arm_controller/follow_joint_trajectory".
  std::vector<std::string> controllers;
  /// True if its trajectory controllers join a goal to where they have the joints by themselves.
  bool controllers_join = false;
  std::string scan_topic;
  struct EmergencyStop {
    std::string topic, field;  ///< "/robot_state", "runstopped"
    bool stops_when = true;    ///< the field's value that stops the robot
  } emergency_stop;
  /// All that the profile names; their limits hold where the robot's description says nothing.
  std::map<std::string, JointLimits> joints;
  std::vector<std::string> gripper_joints;  ///< joints of a gripper's goal; the gap is their sum
  /// Frame of a head whose controller begins at the end of its last goal, not where it looks;
  /// empty: no such head is known. Its x axis is the line of sight.
  std::string gaze_frame;
};

/// The profile's word counts before the table's where it is stricter, in this order: endless
/// motion, control input, other, body or shown. It makes a topic the body's only if the table knows
/// how its motion is stopped, and shows nothing that moves. Of its base, the velocities of people
/// are control inputs, and what lies behind the multiplexer is other.
class RobotTopics {
 public:
  /// Makes the topics of no robot: the table alone.
  RobotTopics() = default;
  explicit RobotTopics(const RobotProfile& robot);

  TopicRole roleOf(std::string_view topic, std::string_view type) const;
  /// The base itself, by the table or the profile: not where a replay enters.
  bool isBehindMultiplexer(std::string_view topic, std::string_view type) const;
  /// Returns why the profile's word for this topic is refused, one clause; empty: it counts, or
  /// there is no word.
  std::string refusal(std::string_view topic, std::string_view type) const;
  /// The profile's names by class, as of isCalled(), the strictest class first.
  using Words = std::map<TopicClass, std::vector<std::string>>;
  const Words& words() const { return words_; }

 private:
  /// Returns the profile's word for it; the strictest, if it says several things.
  std::optional<TopicClass> wordOf(std::string_view topic) const;

  std::string robot_, output_topic_;
  Words words_;
};

}  // namespace afterglow::replay

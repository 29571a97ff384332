/// \file
/// The messages that bring to rest what a topic has set in motion.
/// Sources: ros_controllers (a group controller goes on with its last command; a joint trajectory
/// controller holds on a trajectory without points), ackermann_msgs, actionlib's server, the
/// gripper drivers of Fetch and PR2.
#pragma once

#include <map>
#include <string>

#include "replay/messages/schema.hpp"

namespace afterglow::replay {

enum class StopKind {
  None,        ///< not known: the topic is not played unless a rule file says how it is stopped
  Zero,        ///< the last message, every number of it that has a sign 0
  Speed,       ///< the last AckermannDrive; speed, acceleration and jerk 0: its steering stays
  Fields,      ///< the last message with some fields set; others as they were
  NoPoints,    ///< a trajectory of the last one's joints without points
  Cancel,      ///< a cancel of all goals
  EndsItself,  ///< nothing is sent: it goes to its goal and stops there, and a cancel does harm
  IsStop       ///< the topic moves nothing: its messages stop something
};

struct MotionStop {
  StopKind kind = StopKind::None;
  std::string cancel_topic;              ///< topic of Cancel; empty: that of the goal's own action
  std::map<std::string, double> fields;  ///< values of Fields, by FieldPath
  std::string rule;                      ///< FILE:LINE that says so; empty: it is known

  /// Returns true if each message counts until the next one, and stop() is of the topic's own type.
  bool isSetPoint() const {
    return kind == StopKind::Zero || kind == StopKind::Speed || kind == StopKind::Fields;
  }
};

/// Describes the stop in a clause for people: "zeros stop it", "a cancel on /move_base/cancel stops
/// it (rules.yaml:3)".
std::string describe(const MotionStop& stop);

/// The fields that the stop of a set point changes, with what they become: paths as in FieldPath.
std::map<std::string, double> stoppingFields(const MotionStop& stop, const Schema& schema);

/// Throws std::invalid_argument, one line, if a rule cannot stop messages of this type.
void checkStop(const MotionStop& stop, const Schema& schema);

}  // namespace afterglow::replay

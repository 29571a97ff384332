/// \file
/// /clock, given or followed. Source: wiki.ros.org/Clock.
#pragma once

#include <ros/ros.h>

#include <functional>
#include <string>

#include "nodes/tools/callback_thread.hpp"
#include "replay/clock/followed_clock.hpp"
#include "replay/messages/message.hpp"

namespace afterglow::nodes {

/// Publishes /clock so many times a second while it lives, also while `time` stands. Sets no
/// parameter.
class ClockGiver {
 public:
  ClockGiver(double hz, std::function<replay::Stamp()> time);

 private:
  ros::NodeHandle node_;
  ros::Publisher publisher_;
  CallbackThread thread_;
};

/// The time that something of the robot may take: in its own time. That is a simulation's /clock,
/// which may be slow or stand, where /use_sim_time is set; else steady time. A clock that is set
/// back ends it.
class RobotPatience {
 public:
  explicit RobotPatience(double seconds);
  bool isOver() const;

 private:
  replay::SteadyTime begin_;
  std::int64_t ns_;
};
/// The robot's time, as above: for ages of what it tells.
replay::SteadyTime robotNow();
/// ros::Time::now(), for the stamps of messages: a wall clock may be set.
replay::Stamp rosStampNow();

/// Drives a clock by what is heard on /clock, while it lives.
class ClockFollower {
 public:
  /// Takes `on_jump`, which is told of a step back, or of more than a second, in seconds; by a
  /// thread of its own.
  ClockFollower(replay::FollowedClock& clock, std::function<void(double seconds)> on_jump);

 private:
  CallbackThread thread_;
};

}  // namespace afterglow::nodes

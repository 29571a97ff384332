/// \file
/// /clock, given or followed, and the ROS time that a replay sleeps on and that its stamps are of.
/// Source: wiki.ros.org/Clock.
#pragma once

#include <ros/ros.h>

#include <functional>
#include <memory>
#include <string>

#include "nodes/tools/callback_thread.hpp"
#include "replay/clock/clock.hpp"
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

/// The time that a replay keeps. Live: the robot's, with ROS time left alone: the machine's, or the
/// simulation's /clock where /use_sim_time is set. Sim: the recording's, given on /clock. Follow:
/// another node's /clock.
enum class ReplayClock { Live, Sim, Follow };

/// The clock that a replay sleeps on, and the ROS time that its stamps are of.
class ReplayTime {
 public:
  /// Takes `on_jump`, which is told when a clock that is followed is set back, or ahead by more
  /// than a second, by a thread of its own. Throws std::runtime_error, one line, if /clock is to be
  /// given and another node gives it, too, if /use_sim_time is set and nobody does, or it was not
  /// set when this node began, or if no master answers.
  ReplayTime(ReplayClock kind, std::function<void(double seconds)> on_jump);

  replay::Clock& clock();
  /// ROS time.
  replay::Stamp now() const;
  /// False while a clock that is followed has not shown any time.
  bool hasBegun() const { return (!followed_ || followed_->hasTicked()) && ros::Time::isValid(); }
  /// The name of a clock that is followed though nobody asked for it, for the report; empty: there
  /// is none.
  const std::string& note() const { return note_; }

 private:
  std::unique_ptr<replay::FollowedClock> followed_;  ///< if another clock is followed
  std::unique_ptr<replay::Clock> own_;               ///< else
  std::string note_;
  CallbackThread thread_;  ///< hears /clock
};

}  // namespace afterglow::nodes

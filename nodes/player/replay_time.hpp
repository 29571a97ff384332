/// \file
/// The clock that a replay sleeps on, and the ROS time that its stamps are of.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "nodes/player/ros_clock.hpp"
#include "replay/clock/clock.hpp"
#include "replay/clock/followed_clock.hpp"
#include "replay/messages/message.hpp"

namespace afterglow::nodes {

/// The time that a replay keeps. Live: the robot's, with ROS time left alone: the machine's, or the
/// simulation's /clock where /use_sim_time is set. Sim: the recording's, given on /clock. Follow:
/// another node's /clock.
enum class ReplayClock { Live, Sim, Follow };

class ReplayTime {
 public:
  /// Takes `on_jump`, which is told when a clock that is followed is set back, or ahead by more
  /// than a second; any thread. Throws std::runtime_error, one line, if /clock is to be given and
  /// another node gives it, too, if /use_sim_time is set and nobody does, or it was not set when
  /// this node began, or if no master answers.
  ReplayTime(ReplayClock kind, std::function<void(double seconds)> on_jump);

  replay::Clock& clock();
  /// ROS time.
  replay::Stamp now() const;
  /// False while a clock that is followed has not shown any time.
  bool hasBegun() const {
    return (!followed_ || followed_->hasTicked()) && ros::Time::isValid();
  }
  /// The name of a clock that is followed though nobody asked for it, for the report; empty: there
  /// is none.
  const std::string& note() const { return note_; }

 private:
  std::unique_ptr<replay::FollowedClock> followed_;  ///< if another clock is followed
  std::unique_ptr<replay::Clock> own_;               ///< else
  std::optional<ClockFollower> follower_;
  std::string note_;
};

}  // namespace afterglow::nodes

/// \file
/// The clock that a replay sleeps on, and the ROS time that its stamps are of.
#pragma once

#include <memory>
#include <optional>

#include "nodes/player/ros_clock.hpp"
#include "replay/clock/clock.hpp"
#include "replay/clock/followed_clock.hpp"
#include "replay/messages/message.hpp"

namespace afterglow::nodes {

/// Whose time a replay keeps. Live: the machine's, with ROS time left alone; where /use_sim_time is
/// set it follows /clock. Sim: the recording's, given on /clock. Follow: another node's /clock.
enum class ReplayClock { Live, Sim, Follow };

class ReplayTime {
 public:
  /// Throws std::runtime_error, one line, if /clock is to be given and another node gives it, too,
  /// or if no master answers.
  explicit ReplayTime(ReplayClock kind);

  replay::Clock& clock();
  /// ROS time.
  replay::Stamp now() const;
  /// False while a clock that is followed has not shown any time.
  bool hasBegun() const { return !followed_ || followed_->hasTicked(); }

 private:
  std::unique_ptr<replay::FollowedClock> followed_;  ///< if another clock is followed
  std::unique_ptr<replay::Clock> own_;               ///< else
  std::optional<ClockFollower> follower_;
};

}  // namespace afterglow::nodes

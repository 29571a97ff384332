/// \file
/// The demo's second behavior: the robot sees an obstacle on the floor, shows it and its way round
/// it, and drives there, led by the tracker that leads replayed drives.
///
/// The demo's navigation: a path round what the laser saw, and when to be where on it. Pure, no
/// ROS. Frame: `map`; meters, radians, seconds.
#pragma once

#include <ros/time.h>

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nodes/kitting/kitting_robot.hpp"
#include "nodes/kitting/kitting_room.hpp"
#include "replay/motion/base/base_tracker.hpp"
#include "replay/motion/pose_track.hpp"

namespace afterglow::nodes {

using replay::PlanarPose, replay::PlanarVelocity;

inline Eigen::Vector2d positionOf(const PlanarPose& pose) { return {pose.x, pose.y}; }
inline double headingOf(const Eigen::Vector2d& way) { return std::atan2(way.y(), way.x()); }

using FloorPath = std::vector<Eigen::Vector2d>;

/// A path from start to goal with a point about every 5 cm: straight, or bent to the side that
/// needs less of a detour so that it stays `clearance` from every obstacle point. It leaves and
/// reaches its ends straight. Throws std::invalid_argument if an end is itself within `clearance`.
FloorPath planDetour(const Eigen::Vector2d& start, const Eigen::Vector2d& goal,
                     const std::vector<Eigen::Vector2d>& obstacle, double clearance);

double lengthOf(const FloorPath& path);
/// The point `distance` along the path, or its end.
Eigen::Vector2d pointAlong(const FloorPath& path, double distance);
/// Returns how far along the path its point nearest to `position` is.
double nearestAlong(const FloorPath& path, const Eigen::Vector2d& position);

/// A drive as the player's tracker (replay/motion) takes it: a turn to the path, the path, a turn
/// to the final heading, each from rest to rest.
struct TimedDrive {
  replay::PoseTrack track;
  replay::Stamp turned;  ///< end of the first turn
};

/// Begins at `start`, which should be the path's beginning.
TimedDrive timedDrive(const FloorPath& path, const PlanarPose& start, double final_yaw,
                      replay::Stamp begin);

/// A drive in real time in the caller's thread; throws TaskError. Runs in real time in the caller's
/// thread; throws TaskError. What it is given must outlive it.
class KittingDrive {
 public:
  struct Callbacks {
    std::function<void(const std::string&)> on_moment;  ///< "rotate", "detour", ...
    std::function<void()> say;                          ///< called when it is time for the sentence
  };

  KittingDrive(KittingRobot& robot, const KittingRoom& room, Callbacks callbacks);

  /// Drives until it has arrived; obstacle and way stay lit.
  void run();
  void clearLight();

 private:
  void perceiveAndPlan();
  void tellWhatIsDue(const replay::BaseTracker& tracker);
  void showWhatIsDue();
  void aimAhead(const replay::BaseTracker& tracker);
  Eigen::Vector2d pointToLight(const Eigen::Vector2d& position) const;

  KittingRobot& robot_;
  const KittingRoom& room_;
  Callbacks callbacks_;
  FloorPath path_;
  std::optional<TimedDrive> drive_;
  Eigen::Vector2d p_obstacle_ = Eigen::Vector2d::Zero();  ///< middle of what the laser saw
  ros::Time begin_, next_scan_, next_path_, next_aim_;
  bool has_spoken_ = false, has_turned_ = false, has_passed_ = false;
};

}  // namespace afterglow::nodes

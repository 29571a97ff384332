/// \file
/// The demo's second behavior: the robot sees an obstacle on the floor, shows it and its way round
/// it, and drives there, led by the tracker that leads replayed drives.
#pragma once

#include <ros/time.h>

#include <functional>
#include <optional>
#include <string>

#include "nodes/kitting/kitting_path.hpp"
#include "nodes/kitting/kitting_robot.hpp"
#include "nodes/kitting/kitting_room.hpp"
#include "replay/motion/base/base_tracker.hpp"

namespace afterglow::nodes {

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

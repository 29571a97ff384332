/// \file
/// The demo's second behavior: the robot sees an obstacle on the floor, shows it and its way round
/// it, and drives there.
#pragma once

#include <ros/time.h>

#include <functional>
#include <optional>
#include <string>

#include "nodes/kitting/kitting_plan.hpp"
#include "nodes/kitting/kitting_robot.hpp"

namespace afterglow::nodes {

/// One drive. Runs in real time in the caller's thread; throws TaskError. What it is given must
/// outlive it.
class KittingDrive {
 public:
  struct Callbacks {
    std::function<void(const std::string&)>
        on_moment;              ///< "rotate", "detour", "reach position", ...
    std::function<void()> say;  ///< when it is time for the sentence
  };

  KittingDrive(const DrivePlan& plan, KittingRobot& robot, const World& world, Callbacks callbacks);

  /// Until it has arrived; obstacle and way stay lit.
  void run();
  void clearLight();

 private:
  void perceiveAndPlan();
  void showWhatIsDue();
  void aimAhead(const PlanarVelocity& command);
  Eigen::Vector2d pointToLight(const Eigen::Vector2d& position) const;
  void tellWhatIsDue(const PlanarPose& pose);
  void tellOfPhase(PathFollower::Phase before);
  double elapsed() const { return (ros::Time::now() - begin_).toSec(); }

  const DrivePlan& plan_;
  KittingRobot& robot_;
  const World& world_;
  Callbacks callbacks_;
  const ScanGeometry laser_;
  FloorPath path_;
  Eigen::Vector2d p_obstacle_ = Eigen::Vector2d::Zero();  ///< middle of what the laser saw
  std::optional<PathFollower> follower_;
  ros::Time begin_, next_scan_, next_path_, next_aim_;
  bool has_spoken_ = false, has_passed_ = false;
};

}  // namespace afterglow::nodes

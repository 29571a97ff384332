/// \file
/// The place of a base on the map, from odometry, which is smooth and drifts, and localization,
/// which is right in the mean and noisy: an extended Kalman filter over the pose and the odometry's
/// two scale errors (distance, turns), as in Martinelli, Tomatis and Siegwart, "Simultaneous
/// localization and odometry self calibration for mobile robot", 2007. Localization comes as the
/// odom frame's pose on the map (tf's map -> odom), so that it holds for any odometry pose and its
/// own delay does not matter.
#pragma once

#include <Eigen/Core>

#include "replay/messages/message.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {

/// The known errors; standard deviations. The defaults suit AMCL and wheel odometry.
struct LocalizationNoise {
  double position = 0.03;     ///< m, of the localization in x and in y
  double yaw = 0.0175;        ///< rad
  double correlation = 0.2;   ///< s; measurements closer in time have much of their error in common
  double scale = 0.02;        ///< error of the odometry's distances and of its turns
  double slip = 0.005;        ///< m after a meter, growing with the root of the distance
  double slip_turn = 0.012;   ///< rad after a meter, likewise
  double turn_slip = 0.006;   ///< rad after a radian, likewise
  double jump = 0.2;          ///< m; what is farther off than this is an outlier, or a jump
  double jump_turn = 0.1745;  ///< rad
};

/// Poses of a base farther apart than noise and drift between two measurements explain.
bool isJump(const PlanarPose& from, const PlanarPose& to, const LocalizationNoise& noise);

class BaseLocalizer {
 public:
  /// The first measurement, taken as it is, and what the odometry says.
  BaseLocalizer(const LocalizationNoise& noise, const PlanarPose& T_map_odom,
                const PlanarPose& odometry, Stamp at);

  /// The odometry has gone there, forward in time or, for smoothing, backward.
  void move(const PlanarPose& odometry);
  /// The localization says that the odom frame is there. A repeated pose tells nothing new. What
  /// is off by a jump is ignored, until five in a row have been: then the pose jumps to it.
  void correct(const PlanarPose& T_map_odom, Stamp at);

  const PlanarPose& pose() const { return pose_; }  ///< the base's pose on the map
  /// Standard deviation of the estimate along its less certain axis; meters.
  double positionError() const;
  double yawError() const;  ///< radians
  /// Returns both, if one measurement is as good as `measured`, not as the noise it was made with
  /// says.
  PoseError error(const PoseError& measured) const;
  /// The distance that the base has gone since localization last said anything new; meters.
  double goneSinceCorrection() const { return gone_; }

 private:
  /// Covariance of x, y, yaw, scale of distances, scale of turns.
  using Covariance = Eigen::Matrix<double, 5, 5>;

  void forgetPose();
  void observe(Eigen::Index axis, double innovation, double variance);

  LocalizationNoise noise_;
  PlanarPose pose_, odometry_;
  double distance_scale_ = 0, turn_scale_ = 0;
  Covariance covariance_ = Covariance::Zero();
  PlanarPose last_correction_;
  Stamp corrected_at_;
  int outliers_ = 0;
  double gone_ = 0;
};

}  // namespace afterglow::replay

/// \file
/// The projector's place on the robot: one rigid transform from calibrations at several poses of a
/// turret (or whatever carries the projector past a camera); and that transform as files for ROS.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/frames.hpp"

namespace afterglow::calib {

/// The mount by one calibration: T_link_camera (the robot's tf at that moment) *
/// T_camera_projector.
struct MountPose {
  std::string name;  ///< a name for people: "left", "pose 2"
  Rigid<Link, Projector> T_link_projector;
};

/// Farthest a pose may be from the mean of those used.
struct MountLimits {
  double mm = 5;
  double deg = 0.5;
};

struct MountDeviation {
  std::string name;
  double mm = 0, deg = 0;  ///< distance from the mean
  bool is_used = true;
};

struct Mount {
  Rigid<Link, Projector> T_link_projector;
  std::vector<MountDeviation> poses;
  /// Root mean square of the used poses' deviations; empty for one pose, which has no spread.
  std::optional<double> spread_mm, spread_deg;
};

/// The poses contradict each other; what() names them, how far they are apart, and what to check.
class MountRefused : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Mean of translations and of rotations (Markley et al., "Averaging Quaternions", 2007: blind to
/// the sign of a quaternion). From three poses on, one that the others contradict is left out: it
/// is beyond the limits, or, from four on, four times as far off as any of the others. Throws
/// MountRefused if what remains is not within the limits, std::invalid_argument without poses.
Mount averageMount(const std::vector<MountPose>& poses, const MountLimits& limits = {});

/// Eigenvector of the largest eigenvalue of the sum of q q^T. At least one quaternion, of length 1.
Eigen::Quaterniond meanRotation(const std::vector<Eigen::Quaterniond>& rotations);

struct MountFrames {
  std::string link;                                   ///< parent
  std::string projector = "projector_optical_frame";  ///< child
};

/// YAML: parent_frame, child_frame, translation {x, y, z}, rotation {x, y, z, w} as
/// geometry_msgs/Transform has them; spread_mm, spread_deg (null for one pose), poses with their
/// deviations.
std::string staticTransformYaml(const Mount& mount, const MountFrames& frames);

/// A launch file with tf2_ros' static_transform_publisher (x y z qx qy qz qw parent child), or,
/// where its argument `tf2_ros` is false, with afterglow's static_transform_node: Debian 12
/// packages tf2_ros without that program. `has_publisher` is the argument's default. Throws
/// std::invalid_argument for a frame name that is no tf2 name (isFrameName).
std::string staticTransformLaunch(const Mount& mount, const MountFrames& frames,
                                  bool has_publisher = true);

/// Letters, digits, _ - . and / within: what every tool takes, without a leading /.
bool isFrameName(const std::string& name);

}  // namespace afterglow::calib

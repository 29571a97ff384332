/// \file
/// A mount as the files that ROS reads.
#pragma once

#include <string>

#include "calib/mount/mount.hpp"

namespace afterglow::calib {

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

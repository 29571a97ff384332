/// \file
/// The poses that `afterglow calibrate mount` averages: calibrations, each with the camera's pose
/// on the robot at that moment; and their file.
#pragma once

#include <string>
#include <vector>

#include "calib/mount/mount.hpp"

namespace afterglow::nodes {

/// Seven numbers x y z qx qy qz qw as tf has them: meters, and a quaternion of length 1 (1 % off is
/// taken and normalized). Throws std::invalid_argument beginning with `what`.
Eigen::Isometry3d poseFromNumbers(const std::vector<double>& numbers, const std::string& what);

/// One pose of the file.
struct MountRecord {
  std::string name;
  Rigid<Link, Camera> T_link_camera;
  Rigid<Camera, Projector> T_camera_projector;

  calib::MountPose pose() const { return {name, T_link_camera * T_camera_projector}; }
};

/// poses: a list of {name, calibration: FOLDER (relative to the file) or T_camera_projector: 4 rows
/// of 4, camera_tf: [x, y, z, qx, qy, qz, qw] or T_link_camera: 4 rows of 4}; name may be missing.
/// Throws std::runtime_error "FILE:LINE: what is wrong".
std::vector<MountRecord> loadMountRecords(const std::string& path);

/// The same file with one more pose (or another one in the place of that name); made if it is not
/// there. Throws as loadMountRecords does, and if it cannot be written.
void addMountRecord(const std::string& path, const MountRecord& record);

}  // namespace afterglow::nodes

/// \file
/// The poses that `afterglow calibrate mount` averages: calibrations, each with the camera's pose
/// on the robot at that moment; and their file.
#pragma once

#include <string>
#include <vector>

#include "calib/mount/turret_fit.hpp"

namespace afterglow::nodes {

/// Seven numbers x y z qx qy qz qw as tf has them: meters, and a quaternion of length 1 (1 % off is
/// taken and normalized). Throws std::invalid_argument beginning with `what`.
Eigen::Isometry3d poseFromNumbers(const std::vector<double>& numbers, const std::string& what);

/// The camera's optical frame, by a calibration's T_camera_projector.yaml. Throws
/// std::runtime_error if that names none.
std::string cameraFrameOf(const std::string& calibration_folder);

/// A pose of the file.
struct MountRecord {
  std::string name;
  Rigid<Link, Camera> T_link_camera;
  Rigid<Camera, Projector> T_camera_projector;

  /// A turret's links, the base first, and by tf each in the one before; else empty.
  std::vector<std::string> links;
  std::vector<Eigen::Isometry3d> T_parent_link;

  calib::MountPose pose() const { return {name, T_link_camera * T_camera_projector}; }
  calib::TurretPose turretPose() const { return {pose(), T_parent_link}; }
};

/// The links that all poses name; empty if none names any. Throws std::runtime_error where they
/// differ.
std::vector<std::string> turretLinks(const std::vector<MountRecord>& records);

/// poses: a list of {name, calibration: FOLDER (relative to the file) or T_camera_projector: 4 rows
/// of 4, camera_tf: [x, y, z, qx, qy, qz, qw] or T_link_camera: 4 rows of 4, turret: a list of
/// {parent, link, tf: [x, y, z, qx, qy, qz, qw] or T_parent_link: 4 rows of 4}}; name and turret
/// may be missing.
/// Throws std::runtime_error "FILE:LINE: what is wrong".
std::vector<MountRecord> loadMountRecords(const std::string& path);

/// The same file with one more pose (or another one in the place of that name); made if it is not
/// there. Throws as loadMountRecords does, and if it cannot be written.
void addMountRecord(const std::string& path, const MountRecord& record);

}  // namespace afterglow::nodes

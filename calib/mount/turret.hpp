/// \file
/// A turret that carries the projector and whose description is a little wrong: where the projector
/// really is at any angle, from the robot's tf; and its file.
#pragma once

#include <string>
#include <vector>

#include "calib/mount/mount.hpp"

namespace afterglow::calib {

/// A joint whose tf is corrected: T_wrong_true (in the parent's frame) before what tf says, and a
/// further turn by `scale` times the angle from `R_parent_middle`, within half a turn of it.
struct TurretJoint {
  std::string parent, link;  ///< tf's names
  Eigen::Isometry3d correction = Eigen::Isometry3d::Identity();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< the axis in the link, of length 1
  Eigen::Quaterniond R_parent_middle = Eigen::Quaterniond::Identity();
  double scale = 0;

  /// The joint's angle, rad, from the middle; -pi to pi.
  double angle(const Eigen::Isometry3d& T_parent_link) const;
  Eigen::Isometry3d corrected(const Eigen::Isometry3d& T_parent_link) const;
};

/// A turret as it is.
struct Turret {
  std::vector<TurretJoint> joints;  ///< the joints, from the base on
  Rigid<Link, Projector> T_link_projector;
  std::string projector_frame = MountFrames().projector;

  /// The projector in the turret's base, from tf's word on each joint. Throws std::invalid_argument
  /// for another number of them than joints.
  Eigen::Isometry3d T_base_projector(const std::vector<Eigen::Isometry3d>& T_parent_link) const;
};

/// The vector along the axis of a turn, as long as its angle, 0 to pi.
Eigen::Vector3d turnOf(const Eigen::Matrix3d& R);

/// Returns the text of a file for turret_tf_node. Each remark is a comment of one line.
std::string turretYaml(const Turret& turret, const std::vector<std::string>& remarks);
/// Throws std::runtime_error "FILE:LINE: what is wrong".
Turret loadTurret(const std::string& path);

/// A launch file that starts turret_tf_node with the turret.yaml beside it.
std::string turretLaunch(const Turret& turret);

}  // namespace afterglow::calib

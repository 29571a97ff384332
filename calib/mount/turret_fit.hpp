/// \file
/// The errors of a turret's description: places, directions, zeros and scales of its axes,
/// estimated from calibrations at several angles together with how the projector sits on it.
#pragma once

#include <string>
#include <vector>

#include "calib/mount/turret.hpp"

namespace afterglow::calib {

/// The result of one calibration, and how the turret stood. Link is the turret's last link.
struct TurretPose {
  MountPose mount;
  /// The robot's tf: each joint's link in the one before, starting at the turret's base. A joint
  /// turns its link about an axis through the link's origin, as a URDF's revolute joint does.
  std::vector<Eigen::Isometry3d> T_parent_link;

  Eigen::Isometry3d T_base_link() const;
};

/// The error of a joint's description, as far as the poses tell: estimate and standard deviation.
/// An error that they do not tell is near 0 and its deviation near the prior's; so is an error that
/// makes no difference to light (a pan's zero against the tilt's axis turned about the pan's).
struct JointError {
  struct Value {
    double value = 0, deviation = 0;
  };
  Value axis_deg;  ///< error of its direction
  Value axis_mm;   ///< error of its place, across the axis
  Value zero_deg;  ///< error of its zero; the last joint's is also the projector's seat
  Value scale_percent;
  double span_deg = 0;  ///< angle between the outermost poses
};

struct TurretFit {
  Turret turret;
  std::vector<JointError> errors;     ///< a joint each
  std::vector<MountDeviation> poses;  ///< deviations from where the turret then has the projector
  double spread_mm = 0, spread_deg = 0;
  /// The most that light at 1.5 m will be off, in 95 of 100 cases, by the poses' own agreement: at
  /// angles between those of the poses, and up to 45 degrees beyond them.
  double light_mm = 0, light_beyond_mm = 0;
};

/// Returns why the poses do not tell how the turret errs, one advice a line ("tilt it, too: ..."):
/// fewer than three, or a joint that turned by less than 20 degrees. Empty if they do. Throws
/// std::invalid_argument for poses that are not of one turret with these links (parent first), not
/// finite, or where a link did more than turn about one axis.
std::vector<std::string> missingTurns(const std::vector<TurretPose>& poses,
                                      const std::vector<std::string>& links);

/// Least squares over the poses, with the priors of a turret that was built by a workshop and
/// described with a ruler (turret_fit.cpp has them, and where they come from): few poses do, and
/// what they do not tell stays as described. From four poses on, one that the others contradict is
/// left out. Throws MountRefused if what remains is not within the limits, or missingTurns().
TurretFit fitTurret(const std::vector<TurretPose>& poses, const std::vector<std::string>& links,
                    const MountLimits& limits = {});

/// Returns the remarks of a turret.yaml beside the numbers: how far off light will be, the poses,
/// the joints.
std::vector<std::string> turretRemarks(const TurretFit& fit);

}  // namespace afterglow::calib

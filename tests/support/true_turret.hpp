/// \file
/// A turret as it was really built, beside what its URDF says: lines in space that a projector is
/// turned about (product of exponentials), and where its light then falls.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "calib/mount/turret_fit.hpp"
#include "calib/number_text.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::test {

/// Standard deviations of how it was built and measured.
struct TurretFaults {
  double axis_deg = 0.5, axis_mm = 3, zero_deg = 1, scale_percent = 0.1;
  double mount_deg = 2, mount_mm = 10;  ///< of how the projector sits, which no URDF says
  /// Of each calibration, about and along each axis: the greatest that calibrations of the
  /// referee's rooms, faulty ones too, say of themselves (the projector's depth has 0.14 mm).
  double pose_deg = 0.01, pose_mm = 0.1;
};

/// Pan turns about z, tilt about y of a turret's base; the projector looks along x. Angles in
/// degrees, as the joints' encoders have them.
class TrueTurret {
 public:
  explicit TrueTurret(unsigned seed, TurretFaults faults = {}) : random_(seed), faults_(faults) {
    pan_ = line(Eigen::Vector3d(0, 0, 0.05), Eigen::Vector3d::UnitZ());
    tilt_ = line(Eigen::Vector3d(0.02, 0, 0.13), Eigen::Vector3d::UnitY());
    Eigen::Matrix3d optical;  // x right, y down, z forward
    optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    start_.linear() = optical;
    start_.translation() = Eigen::Vector3d(0.09, 0.03, 0.16);
    start_ = start_ * error(faults.mount_deg, faults.mount_mm);
  }

  static std::vector<std::string> links() { return {"turret_base", "pan_link", "tilt_link"}; }

  /// What robot_state_publisher says: by the URDF, not by how it was built.
  static std::vector<Eigen::Isometry3d> tf(double pan, double tilt) {
    Eigen::Isometry3d T_base_pan(Eigen::Translation3d(0, 0, 0.05)),
        T_pan_tilt(Eigen::Translation3d(0.02, 0, 0.08));
    T_base_pan.rotate(Eigen::AngleAxisd(pan / calib::kDegrees, Eigen::Vector3d::UnitZ()));
    T_pan_tilt.rotate(Eigen::AngleAxisd(tilt / calib::kDegrees, Eigen::Vector3d::UnitY()));
    return {T_base_pan, T_pan_tilt};
  }

  Eigen::Isometry3d T_base_projector(double pan, double tilt) const {
    return about(pan_, pan) * about(tilt_, tilt) * start_;
  }

  /// A calibration at these angles, and tf's word on them.
  calib::TurretPose pose(const std::string& name, double pan, double tilt) {
    calib::TurretPose pose;
    pose.T_parent_link = tf(pan, tilt);
    const Eigen::Isometry3d seen =
        T_base_projector(pan, tilt) * error(faults_.pose_deg, faults_.pose_mm);
    pose.mount = {name, Rigid<Link, Projector>(
                            (pose.T_parent_link[0] * pose.T_parent_link[1]).inverse() * seen)};
    return pose;
  }

  /// Angles as a person would choose them, wide apart.
  std::vector<calib::TurretPose> fivePoses() {
    return {pose("middle", 0, 0), pose("low left", 60, 35), pose("low right", -60, 35),
            pose("high left", 40, -40), pose("high right", -40, -40)};
  }

  /// Where light lands on a wall 1.5 m ahead, beside where it was to land, in millimeters, for a
  /// picture drawn as if the projector were at this pose.
  std::vector<double> lightOff_mm(double pan, double tilt, const Eigen::Isometry3d& thought) const {
    const calib::Lens lens = viewsonic();
    const Eigen::Isometry3d is = T_base_projector(pan, tilt);
    std::vector<double> off;
    for (double u = 0; u <= 1280; u += 320) {
      for (double v = 0; v <= 800; v += 200) {
        const Eigen::Vector3d wanted = onWall(lens, u, v);
        const Eigen::Vector3d p = thought.inverse() * (is * wanted);
        const Eigen::Vector3d pixel = lens.K * (p / p.z());
        off.push_back(1000 * (onWall(lens, pixel.x(), pixel.y()) - wanted).norm());
      }
    }
    return off;
  }

  /// Over the whole range: pan from -90 to 90, tilt from -60 up to 45 down. Sorted.
  std::vector<double> lightOff_mm(const calib::Turret& turret) const {
    std::vector<double> all;
    for (double pan = -90; pan <= 90; pan += 15) {
      for (double tilt = -60; tilt <= 45; tilt += 15) {
        const auto off = lightOff_mm(pan, tilt, turret.T_base_projector(tf(pan, tilt)));
        all.insert(all.end(), off.begin(), off.end());
      }
    }
    std::sort(all.begin(), all.end());
    return all;
  }

 private:
  struct Line {
    Eigen::Vector3d point, direction;
    double zero_deg, scale;
  };

  Line line(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) {
    const Eigen::Isometry3d off = error(faults_.axis_deg, faults_.axis_mm);
    const double zero_deg = faults_.zero_deg * normal_(random_);
    const double scale = 1 + faults_.scale_percent / 100 * normal_(random_);
    return {point + off.translation(), off.linear() * direction, zero_deg, scale};
  }

  static Eigen::Isometry3d about(const Line& line, double angle_deg) {
    const double angle = (line.scale * angle_deg + line.zero_deg) / calib::kDegrees;
    return Eigen::Translation3d(line.point) * Eigen::AngleAxisd(angle, line.direction) *
           Eigen::Translation3d(-line.point);
  }

  Eigen::Isometry3d error(double deg, double mm) {
    const auto three = [&] {
      return Eigen::Vector3d(normal_(random_), normal_(random_), normal_(random_));
    };
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = mm / 1000 * three();
    const Eigen::Vector3d turn = deg / calib::kDegrees * three();
    if (turn.norm() > 0) T.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
    return T;
  }

  static Eigen::Vector3d onWall(const calib::Lens& lens, double u, double v) {
    return 1.5 * (lens.K.inverse() * Eigen::Vector3d(u, v, 1));
  }

  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  TurretFaults faults_;
  Line pan_, tilt_;
  Eigen::Isometry3d start_ = Eigen::Isometry3d::Identity();
};

}  // namespace afterglow::test

/// \file
/// The frames of the geometry core, each once, and rigid transforms that cannot be chained wrongly.
///
/// | tag       | axes                                   | origin                | published by        |
/// |-----------|----------------------------------------|-----------------------|---------------------|
/// | World     | x forward, y left, z up (REP 103)      | the fixed frame's     | configuration, tf   |
/// | Projector | x right, y down, z forward (optical)   | the projector's lens  | tf, from calibration|
/// | Camera    | x right, y down, z forward (optical)   | the camera's lens     | tf, from calibration|
/// | Surface   | z the surface's normal, toward people | the surface's frame   | tf                  |
/// | Observer  | x right, y down, z forward (optical)   | the bystander's eye   | configuration       |
/// | Link      | the robot's own                        | the robot's own       | robot_state_publisher|
///
/// Meters, radians. Pixels: the center of the top-left pixel is (0, 0), as in OpenCV.
#pragma once

#include <Eigen/Geometry>

namespace afterglow {

struct World {};
struct Projector {};
struct Camera {};
struct Surface {};
struct Observer {};
struct Link {};  // the robot's link that the projector is bolted to

/// T_target_source: p_target = T_target_source * p_source. The product of two needs equal inner
/// frames, so that a chain in the wrong order does not compile.
template <typename Target, typename Source>
class Rigid {
 public:
  Rigid() : matrix_(Eigen::Isometry3d::Identity()) {}
  explicit Rigid(const Eigen::Isometry3d& matrix) : matrix_(matrix) {}

  const Eigen::Isometry3d& matrix() const { return matrix_; }
  Rigid<Source, Target> inverse() const { return Rigid<Source, Target>(matrix_.inverse()); }
  Eigen::Vector3d operator*(const Eigen::Vector3d& p_source) const { return matrix_ * p_source; }

 private:
  Eigen::Isometry3d matrix_;
};

template <typename A, typename B, typename C>
Rigid<A, C> operator*(const Rigid<A, B>& left, const Rigid<B, C>& right) {
  return Rigid<A, C>(left.matrix() * right.matrix());
}

}  // namespace afterglow

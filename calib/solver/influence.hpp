/// \file
/// The share of each view in all that the views share: the normal equations of the finished
/// solution, the boards' poses eliminated. From them follow the covariance, the solution without a
/// view, and how much more the views scatter than their corners' noise explains.
///
/// The uncertainty of a calibration in the room: the error of light over the beam.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "calib/lens.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

/// Indices of the shared parameters: the projector's lens (fx fy cx cy skew D), its pose (rotation
/// vector, translation), the camera's lens, the board's shape.
constexpr Eigen::Index kLensAt = 0, kPoseAt = 13, kCameraAt = 19, kShapeAt = 32, kSharedSize = 42;
using SharedVector = Eigen::Matrix<double, kSharedSize, 1>;
using SharedMatrix = Eigen::Matrix<double, kSharedSize, kSharedSize>;

/// Returns the index of one of the kCalibrationParameters.
inline Eigen::Index sharedIndex(Eigen::Index i) { return i < 4 ? i : i + 1; }  // no skew

struct Influence {
  /// The influence of a view: information, and half the gradient of its squared errors.
  struct OfView {
    SharedMatrix information = SharedMatrix::Zero();
    SharedVector score = SharedVector::Zero();
  };
  std::vector<OfView> views;  ///< influence by view; 0 for unused ones
  SharedMatrix prior = SharedMatrix::Zero();
  std::array<bool, kSharedSize> is_free{};

  /// Rows of what was held are zero; empty if the views leave a parameter undetermined.
  /// `dispersion`: the factor of the variances of the views' scores, not of the prior.
  std::optional<SharedMatrix> covariance(double dispersion = 1) const;
  /// Returns the movement of the solution if this view is left out, to first order.
  SharedVector moveWithout(std::size_t view) const;

  /// Returns how much more the views' scores scatter than the noise of single tags explains,
  /// weighted by what they do to the light: corners of a view share a board that is not quite flat,
  /// a focus, a light. At least 1. `importance`: squared error of the light as a form of the
  /// parameters.
  double dispersion(const SharedMatrix& importance) const;
};

/// Places in the part of the beam that the camera sees, spread evenly over the projector's picture,
/// at 1, 2 and 3 m along the projector's axis.
class Beam {
 public:
  Beam(const ProjectorEstimate& estimate, const Lens& camera);

  /// The mean squared error of light (mm^2) over all places, as a form of the parameters' errors.
  SharedMatrix importance() const;

  /// Returns an error for each distance at which the camera sees light: with a certainty of 95 % 95
  /// % of the light is closer than this to its place, on a surface that faces the beam. From draws
  /// of the parameters, which the same covariance always gets alike. `views`: the fewer there are,
  /// the less sure is the covariance itself. `at_best`: with the covariance of the corners' noise
  /// alone.
  std::vector<LightError> errors(const ProjectorEstimate& estimate,
                                 const ProjectorEstimate& at_best, int views) const;

 private:
  using Slope = Eigen::Matrix<double, 2, kCalibrationParameters>;
  struct Places {
    double distance_m = 0;
    std::vector<Slope> mm;  ///< d mm / d parameters
  };
  /// Returns the spread for each distance.
  std::vector<double> spread_mm(const ProjectorEstimate& estimate) const;

  double focal_px_;
  std::vector<Places> by_distance_;
};

}  // namespace afterglow::calib

/// \file
/// The uncertainty of a calibration in the room: the error of light over the beam.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/lens.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/solver/influence.hpp"

namespace afterglow::calib {

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

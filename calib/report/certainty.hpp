/// \file
/// The meaning of a calibration's covariance for light on a surface, and the distance between two
/// calibrations.
#pragma once

#include <optional>
#include <vector>

#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

/// Half the longest axis of the 95 % ellipse.
struct Uncertainty {
  double px = 0;
  double mm = 0;  ///< error on a surface facing the projector
};

/// Returns the uncertainty of the light for a point on the ray of a projector's pixel, at a
/// distance (m) along the optical axis. Empty if no ray within the lens's model reaches the pixel.
std::optional<Uncertainty> uncertaintyAt(const ProjectorEstimate& estimate,
                                         const Eigen::Vector2d& pixel, double distance_m);

/// uncertaintyAt over the projector's picture, cell by cell.
struct UncertaintyGrid {
  int columns = 0, rows = 0;
  double distance_m = 0;
  Eigen::Vector2d cell_px;                        ///< size of a cell in the projector's pixels
  std::vector<std::optional<Uncertainty>> cells;  ///< row-major, at the cells' centers

  const std::optional<Uncertainty>& at(int column, int row) const {
    return cells.at(static_cast<std::size_t>(row * columns + column));
  }
};
/// Four cells across and down for each one of Coverage.
UncertaintyGrid uncertaintyGrid(const ProjectorEstimate& estimate, double distance_m);

/// The movement of the light for fixed points in the camera's frame from one calibration to
/// another, root mean square over the projector's picture.
struct LightShift {
  double rms_px = 0, rms_mm = 0;
  double largest_mm = 0;
};

/// Points lie at a distance (m) along the former's axis. Empty if the pictures' sizes differ or no
/// point is lit by both.
std::optional<LightShift> shiftBetween(const ProjectorEstimate& before,
                                       const ProjectorEstimate& after, double distance_m);

}  // namespace afterglow::calib

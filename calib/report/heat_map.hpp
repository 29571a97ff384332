/// \file
/// A calibration's uncertainty over the projector's picture, as a drawing.
#pragma once

#include <string>
#include <vector>

#include "calib/report/certainty.hpp"

namespace afterglow::calib {

enum class HeatUnit { kPixels, kMillimeters };

/// uncertaintyAt over a grid of the projector's picture; computed once, drawn in both units.
struct UncertaintyGrid {
  int columns = 0, rows = 0;
  double distance_m = 0;
  Eigen::Vector2d cell_px;                        ///< size of a cell in the projector's pixels
  std::vector<std::optional<Uncertainty>> cells;  ///< row-major, at the cells' centers

  const std::optional<Uncertainty>& at(int column, int row) const {
    return cells.at(static_cast<std::size_t>(row * columns + column));
  }
};
UncertaintyGrid uncertaintyGrid(const ProjectorEstimate& estimate, double distance_m);

/// Colors stand for the same amounts in every report, so that two can be compared. Cells that no
/// corner was measured in are hatched: there the numbers extrapolate.
std::string heatMap(const UncertaintyGrid& grid, HeatUnit unit, const Coverage& coverage,
                    const Lens& projector);
std::string heatLegend(HeatUnit unit);

}  // namespace afterglow::calib

/// \file
/// The drawings of a calibration's report, for drawing.html.
#pragma once

#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/report/certainty.hpp"
#include "nodes/pages/page.hpp"

namespace afterglow::nodes {

/// Draws how many corners were measured in each cell of the projector's picture.
PageData coverageMap(const calib::Coverage& coverage, const calib::Lens& projector);
PageData coverageLegend();

enum class HeatUnit { kPixels, kMillimeters };

/// Colors stand for the same amounts in every report, so that two can be compared. Cells that no
/// corner was measured in are hatched: there the numbers extrapolate.
PageData heatMap(const calib::UncertaintyGrid& grid, HeatUnit unit,
                 const calib::Coverage& coverage, const calib::Lens& projector);
/// [{look, limit}]: amounts below the limit; the last has none.
PageData heatScale(HeatUnit unit);

/// The board's height over its best plane, for figure.html; null if it is flat.
PageData boardFigure(const calib::BoardShape& shape);

/// The residuals of all used views over the projector's picture, with caption and legend, for
/// figure.html.
PageData residualFigure(const calib::Calibration& calibration);

/// A view's photograph with its residuals, cut to the board, or whole where nothing was seen. Null
/// if `photographs` has none of the view's name.
PageData photograph(const calib::ViewResult& view,
                    const std::vector<calib::Photographs>& photographs, double magnification);

}  // namespace afterglow::nodes

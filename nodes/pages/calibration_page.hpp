/// \file
/// report.html of a calibration: its evidence, or why there is none.
///
/// The drawings of a calibration's report, for drawing.html.
///
/// Residuals drawn as magnified lines, over a photograph or over the projector's picture.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/report/report.hpp"
#include "calib/solver/calibration.hpp"
#include "nodes/pages/drawing.hpp"
#include "nodes/pages/page.hpp"

namespace afterglow::nodes {

/// `photographs` match calibration.views by name; those missing have no picture. `history` is what
/// calibrationHistory gives, before or after this calibration was saved.
std::string calibrationPage(const calib::Calibration& calibration,
                            const std::vector<calib::Photographs>& photographs,
                            const std::vector<calib::CalibrationRecord>& history,
                            const std::string& date, const calib::ReportFacts& facts = {});

/// The page for what was refused: reasons, advice, and each view's picture with what was seen.
std::string refusalPage(const calib::CalibrationRefused& refused,
                        const std::vector<calib::Photographs>& photographs,
                        const std::string& date);

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

struct ResidualLine {
  Eigen::Vector2d at, error;  ///< px of the picture drawn on
  std::string look;           ///< printed, projected, outlier
  std::string remark;         ///< remark on an outlier: shown when pointed at
};
using ResidualLines = std::vector<ResidualLine>;

/// A view's residuals in the photograph's pixels, counted from `origin`. What is not finite is
/// left out, here and below.
ResidualLines photographLines(const calib::ViewResult& view,
                              const Eigen::Vector2d& origin = Eigen::Vector2d::Zero());
/// Returns the lines of all used views in the projector's pixels.
ResidualLines projectorLines(const calib::Calibration& calibration);

/// Makes nine of ten lines no longer than a fortieth of the picture's width: 1, 2 or 5 times a
/// power of ten, at least 1.
double magnificationFor(const ResidualLines& lines, int picture_width);
bool hasErrors(const ResidualLines& lines);

/// Draws with a dark halo, to be seen on any photograph, and, where there are errors, a bar of
/// known length.
void drawOnPhotograph(const ResidualLines& lines, double magnification, int width, int height,
                      Drawing& drawing);
void drawOnMap(const ResidualLines& lines, double magnification, int width, Drawing& drawing);

/// Explains the looks that occur; "photo-" before them: as they are on photographs.
PageData residualLegend(const ResidualLines& lines, const std::string& before_look);

}  // namespace afterglow::nodes

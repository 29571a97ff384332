/// \file
/// A view's photograph with its residuals drawn on it.
#pragma once

#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/report/residual_lines.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

/// The view's residuals in the photograph's pixels, counted from `origin`.
ResidualLines photographLines(const ViewResult& view,
                              const Eigen::Vector2d& origin = Eigen::Vector2d::Zero());

/// Cut to the board, or whole where nothing was seen. Says so if `photographs` has none of the
/// view's name.
std::string viewPhotograph(const ViewResult& view, const std::vector<Photographs>& photographs,
                           double magnification);

}  // namespace afterglow::calib

/// \file
/// Decoded light as evidence for the solver: the projector's image is cut into cells, and where a
/// cell lies on the board, the camera's place of its four corners follows from all its pixels.
///
/// As the local homographies of Moreno and Taubin (Simple, Accurate, and Robust Projector-Camera
/// Calibration, 3DIMPVT 2012), but all over the board and not only at the print's corners, and with
/// the covariance of each fit.
#pragma once

#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/gray_code/chessboard.hpp"
#include "calib/gray_code/set.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

/// The cells of a projector's image, as tags from kFirstPatternId on.
Pattern cellPattern(const GrayCode& code);

/// The share of the pixels lit on the board whose code the projector's picture does not have: all
/// but none, unless the stripes were made for a larger one.
double shareOutside(const DecodedLight& light, const Chessboard& chessboard,
                    const std::vector<Eigen::Vector2d>& corners_px);

/// The cells that are lit on the board. `corners_px`: as findCorners has them.
std::vector<SeenTag> litCells(const DecodedLight& light, const GrayCode& code,
                              const Pattern& cells, const Chessboard& chessboard,
                              const std::vector<Eigen::Vector2d>& corners_px);

}  // namespace afterglow::calib

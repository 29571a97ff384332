/// \file
/// Decoded light as evidence for the solver: the projector's image is cut into cells, and where a
/// cell lies on the board, the camera's place of its four corners follows from all its pixels.
///
/// As the local homographies of Moreno and Taubin (Simple, Accurate, and Robust Projector-Camera
/// Calibration, 3DIMPVT 2012), but all over the board and not only at the print's corners, and with
/// the covariance of each fit.
///
/// A printed chessboard as the solver's Board, and the camera from photographs of it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/gray_code/set.hpp"
#include "calib/lens.hpp"
#include "calib/picture.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

/// Inner corners, where four squares meet.
struct Chessboard {
  int columns = 0, rows = 0;
  double square_m = 0;

  std::size_t corners() const { return std::size_t(columns) * std::size_t(rows); }
  /// A corner's place in the board's frame; they count as they are read, from the top left.
  Eigen::Vector2d place(std::size_t corner) const;
  /// Four corners each are one "tag"; up to three are left over.
  Board board() const;
  std::vector<SeenTag> tags(const std::vector<Eigen::Vector2d>& corners_px) const;
};

/// Finds the corners by OpenCV, to a few hundredths of a pixel, never mirrored, and with the
/// columns to the right of the photograph. Empty if not all of them are seen.
std::optional<std::vector<Eigen::Vector2d>> findCorners(const Picture& picture,
                                                        const Chessboard& chessboard);

/// Source: Zhang's method, cv::calibrateCamera. Throws std::invalid_argument for fewer than three
/// views, or views that leave the lens open.
Lens cameraFromChessboards(const std::vector<std::vector<Eigen::Vector2d>>& corners_px,
                           const Chessboard& chessboard, int width, int height);

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

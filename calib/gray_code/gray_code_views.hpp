/// \file
/// Makes input for solveViews of other people's photographs of Gray codes on a chessboard.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/gray_code/lit_cells.hpp"
#include "calib/lens.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

struct GrayCodeOptions {
  std::string folder;  ///< see calib/gray_code/set.hpp
  Chessboard chessboard;
  int width = 0, height = 0;   ///< the projector's, px
  int step = 1;                ///< step of kamino410's code, px
  std::optional<Lens> camera;  ///< lens; else chessboards calibrate the camera
  int threads = 2;
};

struct GrayCodeViews {
  Board board;
  Pattern pattern;  ///< the cells of calib/gray_code/lit_cells.hpp
  Lens camera;
  std::vector<View> views;
  /// The white pictures, for the report.
  std::vector<Photographs> photographs;
};

/// A pose whose chessboard is not found, or whose light cannot be decoded, is a view with faults.
/// Throws std::runtime_error naming the file or folder that cannot be read, has another size or
/// shows no such code; std::invalid_argument for what cameraFromChessboards refuses.
GrayCodeViews readGrayCode(const GrayCodeOptions& options);

}  // namespace afterglow::calib

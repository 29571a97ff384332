/// \file
/// A finished calibration against a view that had no part in it.
#pragma once

#include <optional>

#include "calib/detection/view.hpp"
#include "calib/lens.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

struct HeldOutError {
  int corners = 0;
  double rms_mm = 0, worst_mm = 0;  ///< on the board: where the light should be, and where it is
  double rms_px = 0;                ///< in the projector's picture
};

/// Empty if the board's pose cannot be told or no projected tag lies on it. Pure.
std::optional<HeldOutError> heldOutError(const View& view, const Board& board,
                                         const Pattern& pattern, const Lens& camera,
                                         const ProjectorEstimate& estimate);

}  // namespace afterglow::calib

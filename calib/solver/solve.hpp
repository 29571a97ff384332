/// \file
/// The projector from views of a board whose camera is known.
#pragma once

#include <optional>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/solver/calibration.hpp"

namespace afterglow::calib {

/// The estimation of the camera's focal lengths, center and k1 k2 p1 p2. The given values are known
/// to usualDeviations (calib/solver/camera_change.hpp).
enum class CameraUse {
  RefineIfContradicted,  ///< if the views surely contradict the given ones
  Refine,
  Hold
};

struct SolveOptions {
  CameraUse camera_use = CameraUse::RefineIfContradicted;
  int threads = 2;
  std::optional<double> measured_ruler_m;  ///< measured length of the board's printed ruler
  /// An earlier calibration of the same projector and camera: its lens is known but for what
  /// warming up changes (LensDrift), where it sits is not. Few views are enough then, and need not
  /// cover the picture.
  std::optional<ProjectorEstimate> start;
};

/// Solves corners. Throws CalibrationRefused.
Calibration solveViews(const std::vector<View>& views, const Board& board, const Pattern& pattern,
                       const Lens& camera, const SolveOptions& options = {},
                       const CalibrationProgress& progress = {});

/// Solves photographs: observe, solve, observe again with the projector's lens known, solve again.
/// Throws CalibrationRefused, std::invalid_argument for pictures not of the camera's size.
Calibration solvePhotographs(const std::vector<Photographs>& photographs, const Board& board,
                             const Pattern& pattern, const Lens& camera,
                             const SolveOptions& options = {},
                             const CalibrationProgress& progress = {});

}  // namespace afterglow::calib

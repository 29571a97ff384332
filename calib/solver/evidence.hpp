/// \file
/// The solver's working copy of the views: tags matched with board and pattern, as weighted rays of
/// the camera.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/solver/board_shape.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

using Corners = std::array<Eigen::Vector2d, 4>;
using Matrix8 = Eigen::Matrix<double, 8, 8>;
using Vector8 = Eigen::Matrix<double, 8, 1>;

/// A tag that was seen: where its corners truly are (meters on the board, or pixels of the pattern)
/// and where the camera saw them.
struct Sighting {
  int id = 0;
  Corners target;
  Corners camera_px;
  Corners rays;        ///< normalized undistorted camera coordinates
  Matrix8 covariance;  ///< covariance of camera_px
};

struct ViewEvidence {
  std::string name;
  std::vector<Sighting> printed, projected;
  Rigid<Camera, Surface> T_camera_board;
  bool is_used = true;
  std::string reason;  ///< the reason why it is not used
};

/// Matches tags with the targets and finds each board's pose from its printed tags. Views with
/// faults, or without a pose, come back unused with the reason. Tags that are neither the board's
/// nor the pattern's, and printed ones that do not lie as on the board, are dropped.
std::vector<ViewEvidence> gatherEvidence(const std::vector<View>& views, const Board& board,
                                         const Pattern& pattern, const Lens& camera);

/// Computes the rays again after the camera's estimate has changed. A corner without a ray gets
/// NaN.
void setRays(ViewEvidence& view, const Lens& camera);

/// Returns the point where a camera ray meets the board, in the camera's frame; NaN if it does not.
Eigen::Vector3d onBoard(const Eigen::Vector2d& ray, const Rigid<Camera, Surface>& T_camera_board,
                        const BoardShape& shape = {});

}  // namespace afterglow::calib

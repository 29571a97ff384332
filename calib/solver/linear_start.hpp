/// \file
/// A first estimate of the projector from points in space and their pixels: the direct linear
/// transform (Hartley and Zisserman, Multiple View Geometry, 7.1), which knows no restriction on
/// where the principal point lies.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/frames.hpp"
#include "calib/solver/evidence.hpp"

namespace afterglow::calib {

struct LinearStart {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();  ///< intrinsics with skew, K(2, 2) = 1
  Rigid<Camera, Projector> T_camera_projector;
};

/// Starts from the used views, some of which may be wholly wrong: solves many small samples of
/// views and takes the solution that most other views agree with. Empty if no sample gives a
/// projector that has the boards in front of it.
std::optional<LinearStart> linearStart(const std::vector<ViewEvidence>& views,
                                       const Pattern& pattern);

}  // namespace afterglow::calib

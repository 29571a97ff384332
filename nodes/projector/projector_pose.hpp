/// \file
/// Where the projector will be when its light leaves it.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "nodes/projector/frame_lookup.hpp"

namespace afterglow::nodes {

/// The pose at `when` of something that goes on as it moved from one pose to the other: turning
/// about the same axis in space and advancing along it (a screw), or straight on. Exact for a
/// turret and for a base that drives a circle. `earlier` must be before `later`.
Eigen::Isometry3d extrapolate(const StampedPose& earlier, const StampedPose& later,
                              std::int64_t when_ns);

}  // namespace afterglow::nodes

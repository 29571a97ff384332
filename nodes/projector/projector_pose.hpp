/// \file
/// Where the projector will be when its light leaves it.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "nodes/projector/frame_lookup.hpp"

namespace afterglow::nodes {

/// A pose older than this is no pose: the projector may be anywhere by now.
constexpr std::int64_t kStalePoseNs = 2'000'000'000;

/// The pose at `when` of something that moved from one pose to the other at constant velocity, in
/// translation and in rotation about a fixed axis. `earlier` must be before `later`.
Eigen::Isometry3d extrapolate(const StampedPose& earlier, const StampedPose& later,
                              std::int64_t when_ns);

}  // namespace afterglow::nodes

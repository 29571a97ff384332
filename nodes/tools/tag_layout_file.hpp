/// \file
/// Tags at known places as a file: for `afterglow calibrate verify` and for the drift watch.
#pragma once

#include <string>

#include "calib/verify/tag_layout.hpp"

namespace afterglow::nodes {

/// Keys: family (tag36h11), frame (optional), tags: the printed ones, targets: those of light
/// (optional); each tag {id, center: [x, y], size, yaw_deg: 0} or {id, corners: four [x, y]},
/// meters on the z = 0 plane of the frame. A board.yaml of `calibrate board` is read as well.
/// Throws std::runtime_error "FILE:LINE: what is wrong": unknown keys, ids twice or not of the
/// family, targets with ids below calib::kFirstPatternId, corners that are no square seen from
/// above, tags that overlap.
calib::TagLayout loadTagLayout(const std::string& path);

}  // namespace afterglow::nodes

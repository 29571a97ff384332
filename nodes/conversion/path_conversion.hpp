/// \file
/// nav_msgs/Path -> a line to draw. Semantics: RViz 1.14's path display (path_display.cpp), style
/// Billboards.
#pragma once

#include <nav_msgs/Path.h>

#include "nodes/conversion/converted.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// The line through the poses, in the frame of the path's own header, without repeated points.
/// Fewer than two different points are no line: a value without points, which clears. Refused: a
/// pose that is not finite or absurdly far, more poses than kMostPoints, and poses in a frame other
/// than the path's (RViz ignores theirs and draws them wrong). Pure; throws never.
Converted<render::Lines> toLines(const nav_msgs::Path& message, float width);

}  // namespace afterglow::nodes

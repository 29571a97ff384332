/// \file
/// visualization_msgs/Marker -> what it draws. Semantics: RViz 1.14's marker display
/// (marker_utils.cpp, markers/*.cpp), with faults refused that it would draw as garbage.
#pragma once

#include <visualization_msgs/Marker.h>

#include "nodes/conversion/converted.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// What an ADDed marker draws; the drawable's pose carries shape coordinates into the frame of the
/// marker's header. Action, lifetime and frame are the caller's business.
///
/// Refused: anything not finite or absurdly far; points where their number makes no primitives;
/// colors that are not one a point (TRIANGLE_LIST: or one a triangle); extents of 0 or below where
/// there would be nothing to see. One extent of 0 draws a solid flat; TEXT_VIEW_FACING and
/// MESH_RESOURCE are not drawn yet.
/// Pure; throws never.
Converted<render::Drawable> toDrawable(const visualization_msgs::Marker& marker);

}  // namespace afterglow::nodes

/// \file
/// visualization_msgs/Marker -> what it draws. Semantics: RViz 1.14's marker display
/// (marker_utils.cpp, markers/*.cpp), with faults refused that it would draw as garbage.
#pragma once

#include <visualization_msgs/Marker.h>

#include "nodes/conversion/converted.hpp"
#include "nodes/conversion/marker_assets.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// What an ADDed marker draws; the drawable's pose carries shape coordinates into the frame of the
/// marker's header. Action, lifetime and frame are the caller's business.
///
/// Refused: anything not finite or absurdly far; points where their number makes no primitives;
/// colors that are not one a point (TRIANGLE_LIST: or one a triangle); extents of 0 or below where
/// there would be nothing to see; meshes and texts as MarkerAssets does. One extent of 0 draws a
/// solid flat.
///
/// TEXT_VIEW_FACING: scale.z is the height of a capital (the message's definition; RViz draws it
/// smaller, because its font's cells are that high). MESH_RESOURCE: with
/// mesh_use_embedded_materials the file's flat colors, times the marker's color unless that is all
/// zero.
Converted<render::Drawable> toDrawable(const visualization_msgs::Marker& marker,
                                       MarkerAssets& assets);

}  // namespace afterglow::nodes

/// \file
/// geometry_msgs/Polygon, nav_msgs/GridCells and sensor_msgs/Range -> lines, faces and cones.
/// Semantics: RViz 1.14 (polygon_display.cpp, grid_cells_display.cpp, range_display.cpp).
#pragma once

#include <geometry_msgs/Polygon.h>
#include <nav_msgs/GridCells.h>
#include <sensor_msgs/Range.h>

#include "nodes/conversion/path_conversion.hpp"

namespace afterglow::nodes {

/// The most corners of a polygon that is filled, and cells of one message.
constexpr std::size_t kMostFilledCorners = 1'000, kMostGridCells = std::size_t{1} << 19;

/// The outline, closed, or, `filled`, the face, as it lies in its best plane; none of no points.
/// Refused: points that are not finite or absurdly far, too many, and a face without an area.
Converted<Drawables> toPolygonShapes(const geometry_msgs::Polygon& polygon, const PathStyle& style,
                                     bool filled, const render::Color& color);

/// Rectangles along x and y around the cells. Refused: sizes that are not positive, cells that are
/// not finite or absurdly far, more than kMostGridCells.
Converted<Drawables> toCellShapes(const nav_msgs::GridCells& message, const render::Color& color);

/// A cone from the sensor along x up to the range; none without a return. A ranger of a fixed
/// distance (min_range is max_range) says -Inf if something is within it. Refused: a field of view
/// that is none.
Converted<Drawables> toConeShapes(const sensor_msgs::Range& message, const render::Color& color);

}  // namespace afterglow::nodes

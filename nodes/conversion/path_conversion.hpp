/// \file
/// nav_msgs/Path -> lines and, if wanted, axes or arrows at its poses; poses alone, and their
/// spread. Semantics: RViz 1.14 (path_display.cpp, pose_display.cpp, pose_array_display.cpp,
/// covariance_visual.cpp).
///
/// geometry_msgs/Polygon, nav_msgs/GridCells and sensor_msgs/Range -> lines, faces and cones.
/// Semantics: RViz 1.14 (polygon_display.cpp, grid_cells_display.cpp, range_display.cpp).
#pragma once

#include <geometry_msgs/Polygon.h>
#include <geometry_msgs/PoseWithCovariance.h>
#include <nav_msgs/GridCells.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/Range.h>

#include <Eigen/Geometry>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "render/scene/scene.hpp"
#include "render/scene/tessellate.hpp"

namespace afterglow::nodes {

/// The look of paths and poses, from the configuration, not from the messages. Defaults are RViz's
/// for paths, except for its lines of one pixel.
struct PathStyle {
  enum class Line { Lines, Billboards } line = Line::Billboards;
  enum class Poses { None, Axes, Arrows, FlatArrows } poses = Poses::None;
  float width = 0.03f;  ///< meters; for Line::Lines pixels
  /// RViz calls the diameter a radius.
  float axes_length = 0.3f, axes_diameter = 0.03f;
  float flat_arrow_length = 0.3f;
  render::Arrow arrow{0.3f, 0.1f, 0.3f, 0.2f};  ///< shaft 0.1, head 0.2 long
  render::Color arrow_color{1, 85 / 255.0f, 1, 1};
};

/// The shapes of a path, in the path's frame.
struct PathShapes {
  std::vector<render::Lines> strips;
  render::SharedBody glyphs;  ///< axes (in colors of their own) or arrows; may be null
};

/// The most points, and axes or arrows, of one path that are drawn.
constexpr std::size_t kMostPathPoints = 100'000, kMostGlyphs = 2'000;

/// The line through the poses, without repeated points, and a glyph at each of them: all in the
/// frame of the path's own header, as in RViz. A path without anything to show (no pose; one,
/// without glyphs) is a value without shapes: it clears the layer. Remarks: a pose that is not
/// finite or absurdly far (the line breaks there), poses in frames other than the path's, odd
/// orientations, and longer paths, thinned out: their lines to points a millimeter or more apart,
/// their glyphs to every second, third, ... pose. Refused: more poses than kMostPoints. Pure;
/// throws never.
Converted<PathShapes> toPathShapes(const nav_msgs::Path& message, const PathStyle& style);

/// Appends the triangles of a solid.
void addSolid(const render::Solid& solid, const Eigen::Affine3d& placed, render::Body& body);

using Drawables = std::vector<render::Drawable>;

/// A line of the style's width.
render::Lines styledLine(render::PointList points, const PathStyle& style);

/// A glyph at each of the poses, whose frame is theirs; none of no poses. Remarks as of paths.
/// Refused: more poses than kMostPoints, and poses of which none can be drawn.
Converted<Drawables> toPoseShapes(const std::vector<geometry_msgs::Pose>& poses,
                                  const PathStyle& style);

/// The look of a pose's spread; scales are standard deviations.
struct CovarianceStyle {
  bool has_position = true, has_orientation = true;
  render::Color position_color{0.8f, 0.2f, 0.8f, 0.3f};
  render::Color orientation_color{1, 1, 127 / 255.0f, 0.5f};
  float position_scale = 1, orientation_scale = 1;
  float orientation_offset = 1;  ///< length of the triangle, meters
};

/// A glyph at the pose; the ellipsoid of its position's spread, flat where z, roll and pitch are
/// certain; the triangle of its yaw's, before the pose. Unlike RViz, without the discs of roll and
/// pitch, and with the ellipsoid in the message's frame. Remark: a spread beyond kFarthest, which
/// is left out. Refused: numbers that are not finite.
Converted<Drawables> toPoseShapes(const geometry_msgs::PoseWithCovariance& pose,
                                  const PathStyle& style, const CovarianceStyle& spread);

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

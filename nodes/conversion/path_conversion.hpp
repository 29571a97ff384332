/// \file
/// nav_msgs/Path -> lines and, if wanted, axes or arrows at its poses. Semantics: RViz 1.14's path
/// display (path_display.cpp).
#pragma once

#include <nav_msgs/Path.h>

#include <Eigen/Geometry>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// The look of paths, from the configuration, not from the messages. Defaults are RViz's, except
/// for its lines of one pixel.
struct PathStyle {
  enum class Line { Lines, Billboards } line = Line::Billboards;
  enum class Poses { None, Axes, Arrows } poses = Poses::None;
  float width = 0.03f;  ///< meters; for Line::Lines pixels
  /// RViz calls the diameter a radius.
  float axes_length = 0.3f, axes_diameter = 0.03f;
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

}  // namespace afterglow::nodes

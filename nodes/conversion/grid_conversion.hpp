/// \file
/// nav_msgs/OccupancyGrid, its updates, and sensor_msgs/Image -> rectangles of one color each.
/// Semantics of grids: RViz 1.14 (map_display.cpp).
#pragma once

#include <map_msgs/OccupancyGridUpdate.h>
#include <nav_msgs/OccupancyGrid.h>
#include <sensor_msgs/Image.h>

#include <optional>
#include <string>

#include "calib/lens.hpp"
#include "nodes/conversion/path_conversion.hpp"

namespace afterglow::nodes {

/// RViz's color schemes of maps.
enum class ColorScheme { Map, Costmap, Raw };
render::Rgba cellColor(ColorScheme scheme, std::int8_t value);

/// The most cells of a map, and the most rectangles of equal cells that a map or an image becomes:
/// a more detailed one is drawn at half, a quarter, ... of its resolution.
constexpr std::size_t kMostMapCells = std::size_t{1} << 26;
constexpr std::size_t kMostRectangles = std::size_t{1} << 17;

/// Returns why a map cannot be drawn; empty: it can.
std::string mapFault(const nav_msgs::OccupancyGrid& map);

/// The cells' rectangles, in the map's frame; none of a map without cells. Of cells that become
/// one, the greatest value counts. Refused: mapFault(). Remark: less than its resolution is drawn.
Converted<Drawables> toMapShapes(const nav_msgs::OccupancyGrid& map, ColorScheme scheme);

/// Writes an update into a map that has no fault. Returns why it cannot; empty: it has.
std::string updateMap(const map_msgs::OccupancyGridUpdate& update, nav_msgs::OccupancyGrid& map);

/// The plane of an image: seen by a camera, `distance` before its lens, in its optical frame; else
/// `width` wide around `center` in the xy plane of a frame, its top towards +y. Meters.
struct ImagePlane {
  std::optional<calib::Lens> lens = std::nullopt;
  double distance = 1;
  double width = 1;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
};

/// The pixels' rectangles. Of pixels that become one, the mean counts. Refused: what toColors()
/// refuses, and another size than the lens's. Remark: as of maps.
Converted<Drawables> toImageShapes(const sensor_msgs::Image& message, const ImagePlane& plane);

}  // namespace afterglow::nodes

/// \file
/// The identity of the map that a robot is localized on.
#pragma once

#include <nav_msgs/OccupancyGrid.h>

#include <string>

namespace afterglow::nodes {

/// SHA-256 over size, resolution, origin and cells: the same for the same map, whenever it was
/// loaded.
std::string mapIdentity(const nav_msgs::OccupancyGrid& map);

}  // namespace afterglow::nodes

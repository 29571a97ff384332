/// \file
/// sensor_msgs/LaserScan -> a point cloud to draw, as RViz's laser scan display does.
#pragma once

#include <sensor_msgs/LaserScan.h>

#include "nodes/conversion/cloud_conversion.hpp"

namespace afterglow::nodes {

/// Points in the plane z = 0 of the scanner's frame, angles counter-clockwise from x. Ranges
/// outside [range_min, range_max] and those that are no numbers are left out; a scan without ranges
/// clears. All rays count as of the header's stamp. Refused: angles or limits that are no numbers,
/// more ranges than kMostPoints; colored by intensity, also intensities that are not one a range.
/// Pure; throws never.
Converted<render::PointCloud> toPointCloud(const sensor_msgs::LaserScan& message,
                                           const CloudStyle& style);

}  // namespace afterglow::nodes

/// \file
/// sensor_msgs/LaserScan -> a point cloud to draw, as RViz's laser scan display does.
#pragma once

#include <sensor_msgs/LaserScan.h>

#include <vector>

#include "nodes/conversion/cloud_conversion.hpp"

namespace afterglow::nodes {

/// The times at which the points of a scan were measured: a turning scanner measures ray after ray.
struct Sweep {
  std::vector<float> seconds;  ///< seconds after the stamp, for each point; empty: all at the stamp
  double last_s = 0;           ///< time of the last ray, whether it returned or not
};

struct ScanPoints {
  render::PointCloud cloud;
  Sweep sweep;
};

/// Points in the plane z = 0 of the scanner's frame, angles counter-clockwise from x. Ranges
/// outside [range_min, range_max] and those that are no numbers are left out; a scan without ranges
/// clears the layer. The points are as the scanner saw them, each at its own time (Sweep).
/// Refused: angles or limits that are no numbers, a time_increment that is no number or makes the
/// scan longer than tf remembers, more ranges than kMostCloudPoints; if colored by intensity,
/// another number of intensities than ranges. Pure; throws never.
Converted<ScanPoints> toScanPoints(const sensor_msgs::LaserScan& message, const CloudStyle& style);

}  // namespace afterglow::nodes

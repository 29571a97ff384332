/// \file
/// sensor_msgs/LaserScan -> a point cloud to draw, as RViz's laser scan display does.
#pragma once

#include <sensor_msgs/LaserScan.h>

#include <vector>

#include "nodes/conversion/cloud_conversion.hpp"

namespace afterglow::nodes {

/// When the points of a scan were measured: a turning scanner's rays are not of one moment.
struct Sweep {
  std::vector<float> seconds;  ///< after the stamp, one a point; empty: all are as of the stamp
  double last_s = 0;           ///< of the last ray, whether it returned or not
};

struct ScanPoints {
  render::PointCloud cloud;
  Sweep sweep;
};

/// Points in the plane z = 0 of the scanner's frame, angles counter-clockwise from x. Ranges
/// outside [range_min, range_max] and those that are no numbers are left out; a scan without ranges
/// clears. The points are as the scanner saw them, each at its own time (Sweep).
/// Refused: angles or limits that are no numbers, a time_increment that is none or makes the scan
/// longer than tf remembers, more ranges than kMostCloudPoints; colored by intensity, also
/// intensities that are not one a range. Pure; throws never.
Converted<ScanPoints> toScanPoints(const sensor_msgs::LaserScan& message, const CloudStyle& style);

}  // namespace afterglow::nodes

/// \file
/// The points of a moving scanner's scan, put where they were seen. Semantics: laser_geometry's
/// transformLaserScanToPointCloud, which RViz uses, with more than its two poses for a scan.
#pragma once

#include <ros/time.h>

#include <optional>
#include <string>

#include "nodes/conversion/scan_conversion.hpp"
#include "nodes/projector/frame_lookup.hpp"

namespace afterglow::nodes {

/// The points as the frame would have seen all of them at `stamp`, given that the fixed frame stood
/// still. Empty while tf does not know the frame from the first ray's time to the last one's.
/// Between poses 10 ms apart motion is taken for steady.
std::optional<render::PointList> deskew(const render::PointList& points, const Sweep& sweep,
                                        const std::string& frame, ros::Time stamp,
                                        FrameLookup& frames);

}  // namespace afterglow::nodes

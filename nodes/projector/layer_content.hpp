/// \file
/// What a cloud, scan or path shows, as its layer is configured.
#pragma once

#include <nav_msgs/Path.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>

#include "nodes/conversion/converted.hpp"
#include "nodes/projector/layer_config.hpp"
#include "nodes/projector/layer_state.hpp"

namespace afterglow::nodes {

/// Without drawables it shows nothing: it clears. Frame and stamp are left to be set. Refusals and
/// remarks are the conversions'. Pure; throws never.
Converted<Content> toContent(const sensor_msgs::PointCloud2& message, const LayerConfig& config);
Converted<Content> toContent(const sensor_msgs::LaserScan& message, const LayerConfig& config);
Converted<Content> toContent(const nav_msgs::Path& message, const LayerConfig& config);

}  // namespace afterglow::nodes

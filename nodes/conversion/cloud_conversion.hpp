/// \file
/// sensor_msgs/PointCloud2 -> a point cloud to draw. Semantics: RViz 1.14 (point_cloud_common.cpp,
/// point_cloud_transformers.cpp); stricter about sizes, and it honors row_step and is_bigendian,
/// which RViz does not.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include "nodes/conversion/cloud_color.hpp"
#include "nodes/conversion/converted.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// How a topic's points look; configured, for it is not in the messages.
struct CloudStyle {
  render::PointStyle style = render::PointStyle::FlatSquares;
  float size = 0.01f;  ///< metres; for PointStyle::Points pixels
  ColorSource color = ColorSource::Flat;
};

/// Points in the frame of the message's header. Those that are not finite or absurdly far are left
/// out. Fields are found by name (the first of a name counts): x, y, z as FLOAT32 or FLOAT64; rgb
/// or rgba (with alpha) as FLOAT32, INT32 or UINT32; intensity or intensities of any number type.
/// A cloud of no points is a value without points whatever its fields, for it clears. Axis colors
/// are not made here: they follow from where the cloud comes to lie (colorByAxis).
/// Refused: sizes that do not fit the data, missing fields and types other than these, more points
/// than kMostPoints. Pure; throws never.
Converted<render::PointCloud> toPointCloud(const sensor_msgs::PointCloud2& message,
                                           const CloudStyle& style);

}  // namespace afterglow::nodes

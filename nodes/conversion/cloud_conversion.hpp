/// \file
/// sensor_msgs/PointCloud2 -> a point cloud to draw. Semantics: RViz 1.14 (point_cloud_common.cpp,
/// point_cloud_transformers.cpp); stricter about sizes, and it honors row_step and is_bigendian,
/// which RViz does not.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <cstddef>
#include <string>

#include "nodes/conversion/cloud_color.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

/// The look of a topic's points; from the configuration, not from the messages.
struct CloudStyle {
  render::PointStyle style = render::PointStyle::FlatSquares;
  float size = 0.01f;  ///< meters; for PointStyle::Points pixels
  ColorSource color = ColorSource::Flat;
  std::string channel = "intensity";  ///< the field of ColorSource::Intensity
  ColorScale scale = {};              ///< Intensity and axes
  bool axis_of_fixed_frame = true;    ///< else of the cloud's own frame
};

/// The most points of one message that are drawn; of a larger cloud every second, third, ...
constexpr std::size_t kMostCloudPoints = std::size_t{1} << 20;

/// Points in the frame of the message's header. Those that are not finite or absurdly far are left
/// out. Fields are found by name (FieldFinder): x, y, z as FLOAT32 or FLOAT64; rgb or rgba (with
/// alpha) as FLOAT32, INT32 or UINT32 for Rgb8 and Mono8; r, g, b as FLOAT32 or FLOAT64, 0 to 1,
/// for RgbF32; the channel ("intensity" may be "intensities") of any number type for Intensity. A
/// cloud without points is a value without points, whatever its fields: it clears the layer. Axis
/// colors are made later, when the cloud's place is known (colorByAxis). Refused: sizes that
/// do not fit the data, missing fields and types other than these. Remarks: longer data, odd
/// fields, more points than kMostCloudPoints. Pure; throws never.
Converted<render::PointCloud> toPointCloud(const sensor_msgs::PointCloud2& message,
                                           const CloudStyle& style);

}  // namespace afterglow::nodes

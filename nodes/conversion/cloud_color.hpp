/// \file
/// Colors that are not in a message but follow from its values. Semantics: RViz 1.14,
/// point_cloud_transformers.cpp (Intensity and AxisColor with automatic bounds, use rainbow).
#pragma once

#include <vector>

#include "render/scene/scene.hpp"

namespace afterglow::nodes {

enum class ColorSource { Flat, Rgb8, Intensity, AxisX, AxisY, AxisZ };

/// Red at 0 over yellow, green, cyan and blue to magenta at 1 (hue 0 to 300 degrees).
render::Color rainbow(double share);

/// The rainbow from the least value (red) to the greatest (magenta); all red if they are equal.
/// Values that are not finite are red, too, and count for neither bound.
render::ColorList rainbowOf(const std::vector<double>& values);

/// Axis 0, 1 or 2 of an Axis source.
int axisOf(ColorSource source);
bool isAxis(ColorSource source);

/// Replaces the cloud's colors by the rainbow over its points' coordinates along an axis of the
/// fixed frame.
void colorByAxis(render::PointCloud& cloud, ColorSource source,
                 const Eigen::Isometry3d& T_fixed_cloud);

}  // namespace afterglow::nodes

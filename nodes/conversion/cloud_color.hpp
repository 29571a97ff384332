/// \file
/// Colors made from the values in a message. Semantics: RViz 1.14,
/// point_cloud_transformers.cpp.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "render/scene/scene.hpp"

namespace afterglow::nodes {

enum class ColorSource { Flat, Rgb8, Mono8, RgbF32, Intensity, AxisX, AxisY, AxisZ };

/// The colors of numbers. With equal bounds all get the color of the lower bound.
struct ColorScale {
  bool rainbow = true;
  bool invert = false;                                    ///< the rainbow begins with magenta
  render::Color least{0, 0, 0, 1}, greatest{1, 1, 1, 1};  ///< bounds without the rainbow
  /// The values at the ends of the scale; empty: the least and the greatest of each message.
  std::optional<std::array<double, 2>> bounds;
};

/// Red at 0 over yellow, green, cyan and blue to magenta at 1 (hue 0 to 300 degrees).
render::Color rainbow(double share);

/// Returns a color for each value. Values that are not finite get the color of the lower bound.
render::ColorList colorsOf(const std::vector<double>& values, const ColorScale& scale);

/// The same brightness without hue: MONO8.
render::Color gray(const render::Color& color);

/// Axis 0, 1 or 2 of an Axis source.
int axisOf(ColorSource source);
bool isAxis(ColorSource source);

/// The coordinate that gives a cloud its colors.
struct AxisColor {
  int axis = 2;
  ColorScale scale;
};

/// Replaces the cloud's colors by those of its points' coordinates in the fixed frame.
void colorByAxis(render::PointCloud& cloud, const AxisColor& color,
                 const Eigen::Isometry3d& T_fixed_cloud);

}  // namespace afterglow::nodes

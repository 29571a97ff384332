#include "nodes/conversion/cloud_color.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace afterglow::nodes {
namespace {

std::array<double, 2> boundsOf(const std::vector<double>& values) {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    greatest = std::max(greatest, value);
  }
  return {least, greatest};
}

render::Color between(const render::Color& a, const render::Color& b, double share) {
  const auto s = static_cast<float>(share);
  return {a.r + s * (b.r - a.r), a.g + s * (b.g - a.g), a.b + s * (b.b - a.b), 1};
}

}  // namespace

render::Color rainbow(double share) {
  const double hue = 5 * std::clamp(share, 0.0, 1.0);  // in sixths of the circle
  // Distance from red, green and blue on the hue circle of six; full within 1, none from 2.
  const auto channel = [hue](double at) {
    const double apart = std::abs(hue - at);
    return static_cast<float>(std::clamp(2 - std::min(apart, 6 - apart), 0.0, 1.0));
  };
  return {channel(0), channel(2), channel(4), 1};
}

render::ColorList colorsOf(const std::vector<double>& values, const ColorScale& scale) {
  const auto [least, greatest] = scale.bounds ? *scale.bounds : boundsOf(values);
  // Halves, so that the range of two huge values does not overflow.
  const double half_range = greatest / 2 - least / 2;
  render::ColorList colors;
  colors.reserve(values.size());
  for (const double value : values) {
    const bool placed = std::isfinite(value) && half_range > 0;
    const double share = placed ? std::clamp((value / 2 - least / 2) / half_range, 0.0, 1.0) : 0.0;
    colors.push_back(scale.rainbow ? rainbow(scale.invert ? 1 - share : share)
                                   : between(scale.least, scale.greatest, share));
  }
  return colors;
}

render::Color gray(const render::Color& color) {
  const float light = 0.2989f * color.r + 0.5870f * color.g + 0.1140f * color.b;
  return {light, light, light, color.a};
}

bool isAxis(ColorSource source) {
  return source == ColorSource::AxisX || source == ColorSource::AxisY ||
         source == ColorSource::AxisZ;
}

int axisOf(ColorSource source) {
  if (!isAxis(source)) throw std::logic_error("axisOf: this color source has no axis");
  return static_cast<int>(source) - static_cast<int>(ColorSource::AxisX);
}

void colorByAxis(render::PointCloud& cloud, const AxisColor& color,
                 const Eigen::Isometry3d& T_fixed_cloud) {
  const Eigen::RowVector3d row = T_fixed_cloud.linear().row(color.axis);
  const double origin = T_fixed_cloud.translation()[color.axis];
  std::vector<double> values;
  values.reserve(cloud.points.size());
  for (const Eigen::Vector3f& point : cloud.points.get()) {
    values.push_back(row.dot(point.cast<double>()) + origin);
  }
  cloud.colors = asBytes(colorsOf(values, color.scale));
}

}  // namespace afterglow::nodes

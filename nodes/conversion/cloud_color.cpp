#include "nodes/conversion/cloud_color.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace afterglow::nodes {

render::Color rainbow(double share) {
  const double hue = 5 * std::clamp(share, 0.0, 1.0);  // in sixths of the circle
  // Distance from red, green and blue on the hue circle of six; full within 1, none from 2.
  const auto channel = [hue](double at) {
    const double apart = std::abs(hue - at);
    return static_cast<float>(std::clamp(2 - std::min(apart, 6 - apart), 0.0, 1.0));
  };
  return {channel(0), channel(2), channel(4), 1};
}

render::ColorList rainbowOf(const std::vector<double>& values) {
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    greatest = std::max(greatest, value);
  }
  // Halves, so that the range of two huge values does not overflow.
  const double half_range = greatest / 2 - least / 2;
  render::ColorList colors;
  colors.reserve(values.size());
  for (const double value : values) {
    const bool placed = std::isfinite(value) && half_range > 0;
    colors.push_back(rainbow(placed ? (value / 2 - least / 2) / half_range : 0));
  }
  return colors;
}

bool isAxis(ColorSource source) {
  return source == ColorSource::AxisX || source == ColorSource::AxisY ||
         source == ColorSource::AxisZ;
}

int axisOf(ColorSource source) {
  if (!isAxis(source)) throw std::logic_error("axisOf: this color source has no axis");
  return static_cast<int>(source) - static_cast<int>(ColorSource::AxisX);
}

void colorByAxis(render::PointCloud& cloud, ColorSource source,
                 const Eigen::Isometry3d& T_fixed_cloud) {
  const int axis = axisOf(source);
  std::vector<double> values;
  values.reserve(cloud.points.size());
  for (const Eigen::Vector3f& point : cloud.points) {
    values.push_back((T_fixed_cloud * point.cast<double>())[axis]);
  }
  cloud.colors = rainbowOf(values);
}

}  // namespace afterglow::nodes

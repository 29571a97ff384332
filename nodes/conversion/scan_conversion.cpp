#include "nodes/conversion/scan_conversion.hpp"

#include <cmath>
#include <vector>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {

Converted<render::PointCloud> toPointCloud(const sensor_msgs::LaserScan& message,
                                           const CloudStyle& style) {
  using Result = render::PointCloud;
  const bool by_intensity = style.color == ColorSource::Intensity;
  if (message.ranges.empty()) return {Result{}, {}};
  if (message.ranges.size() > kMostPoints) return refused<Result>("too many points");
  if (!std::isfinite(message.angle_min) || !std::isfinite(message.angle_increment)) {
    return refused<Result>("scan angles are not finite");
  }
  // An endless range_max is legal; rays without return are infinite and left out all the same.
  if (std::isnan(message.range_min) || std::isnan(message.range_max)) {
    return refused<Result>("range limits are no numbers");
  }
  if (by_intensity && message.intensities.size() != message.ranges.size()) {
    return refused<Result>("intensities are not as many as ranges");
  }
  Result cloud;
  cloud.style = style.style;
  cloud.size = style.size;
  render::PointList points;
  std::vector<double> values;
  for (std::size_t i = 0; i < message.ranges.size(); ++i) {
    const double range = static_cast<double>(message.ranges[i]);
    if (!(range >= message.range_min && range <= message.range_max)) continue;
    const double angle = static_cast<double>(message.angle_min) +
                         static_cast<double>(i) * static_cast<double>(message.angle_increment);
    const auto point = toVector(range * std::cos(angle), range * std::sin(angle), 0);
    if (!point) continue;
    points.push_back(*point);
    if (by_intensity) values.push_back(static_cast<double>(message.intensities[i]));
  }
  cloud.points = std::move(points);
  if (by_intensity) cloud.colors = rainbowOf(values);
  return {std::move(cloud), {}};
}

}  // namespace afterglow::nodes

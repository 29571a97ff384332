#include "nodes/conversion/scan_conversion.hpp"

#include <cmath>
#include <string>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kLongestSweep = 10;  // s; tf2_ros remembers as much

/// An angle's or time's step from ray to ray; a single ray has none.
double stepOf(const sensor_msgs::LaserScan& message, float increment) {
  return message.ranges.size() > 1 ? static_cast<double>(increment) : 0;
}

/// Returns why a scan cannot be read, or empty.
std::string scanFault(const sensor_msgs::LaserScan& message, bool by_intensity) {
  if (message.ranges.size() > kMostCloudPoints) return "too many points";
  if (!std::isfinite(message.angle_min) ||
      !std::isfinite(stepOf(message, message.angle_increment))) {
    return "scan angles are not finite";
  }
  // An infinite range_max is legal; rays without return are infinite and left out in any case.
  if (std::isnan(message.range_min) || std::isnan(message.range_max)) {
    return "range limits are no numbers";
  }
  const double last_s =
      stepOf(message, message.time_increment) * static_cast<double>(message.ranges.size() - 1);
  if (!(std::abs(last_s) <= kLongestSweep)) return "time_increment is absurd";
  if (by_intensity && message.intensities.size() != message.ranges.size()) {
    return "intensities are not as many as ranges";
  }
  return {};
}

}  // namespace

Converted<ScanPoints> toScanPoints(const sensor_msgs::LaserScan& message, const CloudStyle& style) {
  ScanPoints scan;
  if (message.ranges.empty()) return {scan, {}};
  const bool by_intensity = style.color == ColorSource::Intensity;
  if (const std::string fault = scanFault(message, by_intensity); !fault.empty()) {
    return refused<ScanPoints>(fault);
  }
  const double increment_s = stepOf(message, message.time_increment);
  const double angle_step = stepOf(message, message.angle_increment);
  const bool is_swept = increment_s != 0;
  scan.sweep.last_s = increment_s * static_cast<double>(message.ranges.size() - 1);
  render::PointList points;
  std::vector<double> values;
  for (std::size_t i = 0; i < message.ranges.size(); ++i) {
    const auto range = static_cast<double>(message.ranges[i]);
    if (!(range >= message.range_min && range <= message.range_max)) continue;
    const double angle =
        static_cast<double>(message.angle_min) + static_cast<double>(i) * angle_step;
    const auto point = toVector(range * std::cos(angle), range * std::sin(angle), 0);
    if (!point) continue;
    points.push_back(*point);
    if (by_intensity) values.push_back(static_cast<double>(message.intensities[i]));
    if (is_swept) {
      scan.sweep.seconds.push_back(static_cast<float>(increment_s * static_cast<double>(i)));
    }
  }
  scan.cloud.style = style.style;
  scan.cloud.size = style.size;
  scan.cloud.points = std::move(points);
  if (by_intensity) scan.cloud.colors = asBytes(colorsOf(values, style.scale));
  return {std::move(scan), {}};
}

}  // namespace afterglow::nodes

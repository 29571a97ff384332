#include "replay/motion/base/floor_scan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "replay/messages/ranges.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {
namespace {

/// m outside of the outline: the range finder's noise on the robot's own edge.
constexpr double kOwnEdge = 0.02;

}  // namespace

FloorScan::FloorScan(const RangeScan& scan, const ScanMount& mount, const Footprint* own_outline,
                     const std::vector<OwnPart>& own_parts)
    : stamp_(scan.stamp),
      angle_min_(scan.angle_min),
      increment_(scan.angle_increment),
      mount_(mount),
      ranges_(scan.ranges.size(), std::nan("")) {
  if (!std::isfinite(angle_min_) || !std::isfinite(increment_) || increment_ == 0 ||
      std::isnan(scan.range_min) || std::isnan(scan.range_max)) {
    throw std::invalid_argument("a scan whose angles or limits are no numbers");
  }
  const auto isOwn = [&](const FloorPoint& point) {
    return (own_outline && own_outline->distanceTo(point) < kOwnEdge) ||
           anyOf(own_parts, [&](const OwnPart& part) {
             return distanceToLine(part.from, part.to, point) < part.radius;
           });
  };
  for (std::size_t beam = 0; beam < scan.ranges.size(); ++beam) {
    const auto range = static_cast<double>(scan.ranges[beam]);
    if (std::isnan(range) || range < scan.range_min) continue;
    ranges_[beam] = std::numeric_limits<double>::infinity();
    if (std::isinf(range) || range > scan.range_max) continue;
    const double angle = angle_min_ + static_cast<double>(beam) * increment_;
    const double x = range * std::cos(angle), y = range * std::sin(angle);
    const FloorPoint at{mount_.origin.x + x * mount_.x_axis.x + y * mount_.y_axis.x,
                        mount_.origin.y + x * mount_.x_axis.y + y * mount_.y_axis.y};
    const bool is_own = isOwn(at);
    ranges_[beam] = is_own ? std::nan("") : range;
    if (is_own) continue;
    points_.push_back({at, beam, range});
    is_blind_ = false;
  }
}

bool FloorScan::sees(const FloorPoint& point) const {
  const std::ptrdiff_t beam = beamTo(point);
  const auto count = static_cast<std::ptrdiff_t>(ranges_.size());
  for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, beam - 1); i <= beam + 1; ++i) {
    if (beam >= 0 && i < count && !std::isnan(ranges_[static_cast<std::size_t>(i)])) return true;
  }
  return false;
}

std::optional<double> FloorScan::beyond(const FloorPoint& point, double beside) const {
  const std::ptrdiff_t beam = beamTo(point);
  if (beam < 0) return {};
  const double away = std::hypot(point.x - mount_.origin.x, point.y - mount_.origin.y);
  const double angle = beside / std::max(away, beside);
  const auto width = static_cast<std::ptrdiff_t>(std::ceil(angle / std::abs(increment_)));
  const auto last = static_cast<std::ptrdiff_t>(ranges_.size()) - 1;
  std::optional<double> nearest;
  for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, beam - width);
       i <= std::min(last, beam + width); ++i) {
    const double range = ranges_[static_cast<std::size_t>(i)];
    if (std::isnan(range)) continue;
    nearest = std::min(nearest.value_or(std::numeric_limits<double>::infinity()), range - away);
  }
  return nearest;
}

/// -1: none looks that way.
std::ptrdiff_t FloorScan::beamTo(const FloorPoint& point) const {
  const double dx = point.x - mount_.origin.x, dy = point.y - mount_.origin.y;
  const double angle = std::atan2(dx * mount_.y_axis.x + dy * mount_.y_axis.y,
                                  dx * mount_.x_axis.x + dy * mount_.x_axis.y);
  // A full circle may begin anywhere.
  for (const double turn : {0., 2 * kPi, -2 * kPi}) {
    const auto beam =
        static_cast<std::ptrdiff_t>(std::lround((angle + turn - angle_min_) / increment_));
    if (beam >= 0 && beam < static_cast<std::ptrdiff_t>(ranges_.size())) return beam;
  }
  return -1;
}

}  // namespace afterglow::replay

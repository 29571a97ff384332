#include "replay/motion/base/floor_scan.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "replay/messages/ranges.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {
namespace {

constexpr double kOutlineStep = 0.1;   // m
constexpr double kLargestRobot = 5;    // m
constexpr double kLeastArea = 1e-4;    // m^2

/// Above zero if c lies to the left of the way from a to b.
double leftOf(const FloorPoint& a, const FloorPoint& b, const FloorPoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Andrew's monotone chain, counter-clockwise.
std::vector<FloorPoint> hullOf(std::vector<FloorPoint> points) {
  std::sort(points.begin(), points.end(), [](const FloorPoint& a, const FloorPoint& b) {
    return a.x < b.x || (a.x == b.x && a.y < b.y);
  });
  std::vector<FloorPoint> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = hull.size();
    for (const FloorPoint& point : points) {
      while (hull.size() >= first + 2 && leftOf(hull[hull.size() - 2], hull.back(), point) <= 0) {
        hull.pop_back();
      }
      hull.push_back(point);
    }
    hull.pop_back();  // the other side begins with it
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

double areaOf(const std::vector<FloorPoint>& hull) {
  double twice = 0;
  for (std::size_t i = 2; i < hull.size(); ++i) twice += leftOf(hull[0], hull[i - 1], hull[i]);
  return twice / 2;
}

std::invalid_argument noFootprint(const std::string& text) {
  return std::invalid_argument("'" + text +
                               "' is no footprint: RADIUS, or corners 'X,Y X,Y X,Y', in meters");
}

}  // namespace

double distanceToLine(const FloorPoint& a, const FloorPoint& b, const FloorPoint& p) {
  const double x = b.x - a.x, y = b.y - a.y, length2 = x * x + y * y;
  const double along = length2 > 0 ? ((p.x - a.x) * x + (p.y - a.y) * y) / length2 : 0;
  const double t = std::clamp(along, 0., 1.);
  return std::hypot(p.x - a.x - t * x, p.y - a.y - t * y);
}

Footprint Footprint::circle(double radius) {
  if (!(radius > 0 && radius <= kLargestRobot)) {
    throw std::invalid_argument("a footprint's radius has to be above 0 and at most 5 m");
  }
  Footprint footprint;
  footprint.corners_ = {{0, 0}};
  footprint.rounding_ = footprint.radius_ = radius;
  return footprint;
}

Footprint Footprint::polygon(const std::vector<std::array<double, 2>>& corners) {
  std::vector<FloorPoint> points;
  for (const auto& [x, y] : corners) points.push_back({x, y});
  Footprint footprint;
  for (const FloorPoint& point : points) {
    if (!(std::hypot(point.x, point.y) <= kLargestRobot)) {
      throw std::invalid_argument("a footprint's corners lie within 5 m");
    }
    footprint.radius_ = std::max(footprint.radius_, std::hypot(point.x, point.y));
  }
  if (points.size() >= 3) footprint.corners_ = hullOf(std::move(points));
  if (footprint.corners_.size() < 3 || areaOf(footprint.corners_) < kLeastArea) {
    throw std::invalid_argument("a footprint's corners have to span an area");
  }
  return footprint;
}

double Footprint::distanceTo(const FloorPoint& point) const {
  if (corners_.size() == 1) {
    return std::hypot(point.x - corners_[0].x, point.y - corners_[0].y) - rounding_;
  }
  double nearest = std::numeric_limits<double>::infinity();
  bool is_inside = true;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const FloorPoint &a = corners_[i], &b = corners_[(i + 1) % corners_.size()];
    nearest = std::min(nearest, distanceToLine(a, b, point));
    is_inside = is_inside && leftOf(a, b, point) >= 0;
  }
  return (is_inside ? -nearest : nearest) - rounding_;
}

std::vector<FloorPoint> Footprint::outline() const {
  std::vector<FloorPoint> points;
  if (corners_.size() == 1) {
    const int count = std::max(16, static_cast<int>(std::ceil(2 * kPi * rounding_ / kOutlineStep)));
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * kPi * i / count;
      points.push_back({rounding_ * std::cos(angle), rounding_ * std::sin(angle)});
    }
    return points;
  }
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const FloorPoint &a = corners_[i], &b = corners_[(i + 1) % corners_.size()];
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    const int count = std::max(1, static_cast<int>(std::ceil(length / kOutlineStep)));
    for (int k = 0; k < count; ++k) {
      const double t = static_cast<double>(k) / count;
      points.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
    }
  }
  return points;
}

Footprint parseFootprint(const std::string& text) {
  std::istringstream words(text);
  std::vector<std::array<double, 2>> corners;
  for (std::string word; words >> word;) {
    std::istringstream numbers(word);
    double x = 0, y = 0;
    char comma = 0;
    if (!(numbers >> x)) throw noFootprint(text);
    if (numbers.eof() && corners.empty() && words.eof()) return Footprint::circle(x);
    if (!(numbers >> comma >> y) || comma != ',' || !numbers.eof()) throw noFootprint(text);
    corners.push_back({x, y});
  }
  if (corners.empty()) throw noFootprint(text);
  return Footprint::polygon(corners);
}

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

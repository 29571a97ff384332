#include "replay/motion/base/floor.hpp"

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
  footprint.radius_ = radius;
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
  if (corners_.empty()) {
    return std::hypot(point.x, point.y) - radius_;
  }
  double nearest = std::numeric_limits<double>::infinity();
  bool is_inside = true;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    const FloorPoint &a = corners_[i], &b = corners_[(i + 1) % corners_.size()];
    nearest = std::min(nearest, distanceToLine(a, b, point));
    is_inside = is_inside && leftOf(a, b, point) >= 0;
  }
  return is_inside ? -nearest : nearest;
}

std::vector<FloorPoint> Footprint::outline() const {
  std::vector<FloorPoint> points;
  if (corners_.empty()) {
    const int count = std::max(16, static_cast<int>(std::ceil(2 * kPi * radius_ / kOutlineStep)));
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * kPi * i / count;
      points.push_back({radius_ * std::cos(angle), radius_ * std::sin(angle)});
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

namespace {

constexpr std::int64_t kTrackStep = 50'000'000;  // ns
constexpr double kFarthestAhead = 20;            // s on a track
constexpr double kPoseStep = 0.02;               // m between two poses
constexpr double kMoving = 0.005;                // m/s
/// m: so much nearer, within so far a way, counts as coming nearer to what is near already.
constexpr double kNearer = 0.01, kNearerWithin = 0.3;
/// m: as far ahead it is asked whether the way is seen; what lies so far out of the footprint.
constexpr double kLook = 0.3, kOutside = 0.03;

/// Many points, as seen from one pose.
class SeenFrom {
 public:
  explicit SeenFrom(const PlanarPose& from)
      : from_(from), c_(std::cos(from.yaw)), s_(std::sin(from.yaw)) {}
  FloorPoint operator()(const FloorPoint& p) const {
    const double x = p.x - from_.x, y = p.y - from_.y;
    return {c_ * x + s_ * y, -s_ * x + c_ * y};
  }

 private:
  const PlanarPose from_;
  const double c_, s_;
};

double wayBetween(const PlanarPose& a, const PlanarPose& b, double radius) {
  return distance(a, b) + radius * std::abs(wrapAngle(b.yaw - a.yaw));
}

struct NearPoint {
  FloorPoint at;
  double distance;  ///< now
};

/// Returns the points that the path can come near to at all.
std::vector<NearPoint> nearPoints(const SweptPath& path, const Footprint& footprint,
                                  double clearance, const std::vector<FloorPoint>& points) {
  const double reach = footprint.radius() + clearance;
  double left = 0, right = 0, low = 0, high = 0;
  for (const SweptPose& pose : path) {
    left = std::min(left, pose.T_base_then.x);
    right = std::max(right, pose.T_base_then.x);
    low = std::min(low, pose.T_base_then.y);
    high = std::max(high, pose.T_base_then.y);
  }
  std::vector<NearPoint> near;
  for (const FloorPoint& p : points) {
    const bool is_near = p.x > left - reach && p.x < right + reach && p.y > low - reach &&
                         p.y < high + reach;
    if (is_near) near.push_back({p, footprint.distanceTo(p)});
  }
  return near;
}

}  // namespace

FloorPoint transformed(const PlanarPose& T, const FloorPoint& p) {
  const PlanarPose at = compose(T, {p.x, p.y, 0});
  return {at.x, at.y};
}

double rimSpeed(const PlanarVelocity& velocity, double radius) {
  return velocity.speed() + radius * std::abs(velocity.turn);
}

SweptPath pathAlong(const PoseTrack& track, Stamp from, const PlanarPose& base, double radius,
                    double longest, bool is_holonomic) {
  SweptPath path(1);
  PlanarPose last = track.at(from);
  // The track's pose may lie before the base or behind it, in the direction in which it drives.
  PlanarVelocity velocity = track.velocityAt(from);
  if (!is_holonomic) velocity.left = 0;
  const PlanarPose lag = between(base, last);
  const double speed = velocity.speed();
  double way = speed > kMoving ? (velocity.forward * lag.x + velocity.left * lag.y) / speed : 0;
  const Stamp end = std::min(track.end(), later(from, kFarthestAhead));
  double added = way;
  for (Stamp at = from; way < longest;) {
    const PlanarPose pose = track.at(at);
    way += wayBetween(last, pose, radius);
    last = pose;
    const bool is_end = at >= end;
    if (is_end || at == from || way - added >= kPoseStep) {
      path.push_back({between(base, pose), std::max(0., way)});
      added = way;
    }
    if (is_end) break;
    at = std::min(end, Stamp{at.ns + kTrackStep});
  }
  return path;
}

SweptPath pathOf(const PlanarVelocity& velocity, double radius, double longest) {
  SweptPath path(1);
  const double speed = rimSpeed(velocity, radius);
  if (speed < kMoving / 10) return path;
  for (double way = 0; way < longest;) {
    way = std::min(longest, way + kPoseStep);
    path.push_back({advance({}, velocity, way / speed), way});
  }
  return path;
}

FreeWay freeWay(const SweptPath& path, const Footprint& footprint, double clearance,
                const std::vector<FloorPoint>& points) {
  const std::vector<NearPoint> near = nearPoints(path, footprint, clearance, points);
  const double reach = footprint.radius() + clearance;
  FreeWay free;
  double passed = 0;
  for (const SweptPose& pose : path) {
    const SeenFrom seen(pose.T_base_then);
    for (const NearPoint& point : near) {
      const bool is_near_now = point.distance < clearance;
      if (is_near_now && pose.way > kNearerWithin) continue;
      const FloorPoint p = seen(point.at);
      if (p.x * p.x + p.y * p.y > reach * reach) continue;
      const double then = footprint.distanceTo(p);
      const bool is_met = is_near_now ? then < point.distance - kNearer : then < clearance;
      if (!is_met || point.distance >= free.distance) continue;
      free = {is_near_now ? 0 : passed, point.at, point.distance};
    }
    if (free.obstacle) break;
    passed = pose.way;
  }
  return free;
}

bool isSeen(const SweptPath& path, const Footprint& footprint, const FloorScan& scan) {
  const auto found = std::find_if(path.begin(), path.end(),
                                  [](const SweptPose& pose) { return pose.way >= kLook; });
  const PlanarPose then = found != path.end() ? found->T_base_then : path.back().T_base_then;
  int seen = 0, unseen = 0;
  for (const FloorPoint& edge : footprint.outline()) {
    const FloorPoint p = transformed(then, edge);
    if (footprint.distanceTo(p) < kOutside) continue;
    ++(scan.sees(p) ? seen : unseen);
  }
  return seen >= unseen;
}

}  // namespace afterglow::replay

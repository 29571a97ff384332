#include "replay/motion/base/swept_path.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::replay {
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

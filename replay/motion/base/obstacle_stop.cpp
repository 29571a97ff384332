#include "replay/motion/base/obstacle_stop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "replay/messages/ranges.hpp"

namespace afterglow::replay {
namespace {

constexpr double kHistory = 1.0;  // s of odometry
/// The thickness below which a thing counts with the beams that meet it: 3 near by, 1 far away.
constexpr double kThin = 0.03;  // m
constexpr int kMostBeams = 3;
/// Points of one thing, and the same thing in two scans.
constexpr double kTogether = 0.1, kAgain = 0.06;  // m
/// The time before which a moving thing was not there, s: nothing was, so far around it and behind
/// it, m.
constexpr double kWhileAgo = 0.5, kWasFree = 0.15;
/// A base that may only creep stands; it goes on when so much is free for so long.
constexpr double kCreeping = 0.03;                    // m/s
constexpr double kFreeAgain = 0.25, kFreeFor = 0.5;  // m, s

bool isNear(const FloorPoint& a, const FloorPoint& b, double distance) {
  const double x = a.x - b.x, y = a.y - b.y;
  return x * x + y * y < distance * distance;
}

/// The beams beside a point that see the same thing, itself among them.
int beamsOn(const std::vector<FloorScan::Point>& points, std::size_t index) {
  int count = 1;
  for (const int step : {-1, 1}) {
    for (int k = 1; k < kMostBeams; ++k) {
      const auto i = static_cast<std::ptrdiff_t>(index) + step * k;
      if (i < 0 || i >= static_cast<std::ptrdiff_t>(points.size())) break;
      const FloorScan::Point& other = points[static_cast<std::size_t>(i)];
      if (!isNear(other.at, points[index].at, kTogether)) break;
      ++count;
    }
  }
  return count;
}

}  // namespace

void ObstacleStop::move(Stamp stamp, const PlanarPose& T_odom_base) {
  if (!odometry_.empty() && stamp <= odometry_.back().first) {
    if (stamp == odometry_.back().first) return;
    odometry_.clear();  // it began anew
  }
  odometry_.emplace_back(stamp, T_odom_base);
  while (secondsBetween(odometry_.front().first, stamp) > kHistory) odometry_.pop_front();
}

void ObstacleStop::hear(const std::shared_ptr<const FloorScan>& scan) {
  if (!scan || scan == scan_) return;
  scan_ = scan;
  watch_.heard(scan->stamp());
  take(*scan);
  recent_.push_back({scan, poseAt(scan->stamp())});
  const auto isOld = [&](const Taken& taken) {
    return secondsBetween(taken.scan->stamp(), scan->stamp()) >= kWhileAgo;
  };
  while (recent_.size() > 1 && isOld(recent_[1])) recent_.pop_front();
}

/// The scan of half a second ago saw that nothing was there.
bool ObstacleStop::moves(const FloorPoint& p_odom) const {
  if (recent_.empty()) return false;
  const Taken& before = recent_.front();
  const double past = secondsBetween(before.scan->stamp(), scan_->stamp());
  if (past < kWhileAgo / 2 || past > 2 * kWhileAgo) return false;
  const FloorPoint p = transformed(inverse(before.T_odom_base), p_odom);
  return before.scan->beyond(p, kWasFree).value_or(0) > kWasFree;
}

/// The nearest in time that is known; a base at rest may be known since long ago.
PlanarPose ObstacleStop::poseAt(Stamp stamp) const {
  PlanarPose pose;
  for (const auto& [at, T_odom_base] : odometry_) {
    if (at > stamp && &T_odom_base != &odometry_.front().second) break;
    pose = T_odom_base;
  }
  return pose;
}

void ObstacleStop::take(const FloorScan& scan) {
  const PlanarPose T_odom_base = poseAt(scan.stamp());
  const std::vector<FloorPoint> before = std::exchange(last_, {});
  obstacles_.clear();
  walkers_.clear();
  for (std::size_t i = 0; i < scan.points().size(); ++i) {
    const FloorScan::Point& point = scan.points()[i];
    last_.push_back(transformed(T_odom_base, point.at));
    const double beams = kThin / (point.range * std::abs(scan.increment()));
    const int needed = std::clamp(static_cast<int>(beams), 1, kMostBeams);
    if (beamsOn(scan.points(), i) >= needed) {
      (moves(last_.back()) ? walkers_ : obstacles_).push_back(last_.back());
    } else if (anyOf(before, [&](const auto& p) { return isNear(p, last_.back(), kAgain); })) {
      obstacles_.push_back(last_.back());
    }
  }
}

double ObstacleStop::wayToStop(double speed) const {
  return speed * options_.reaction + speed * speed / (2 * options_.deceleration);
}

/// So fast that the way to stop is no more than this.
double ObstacleStop::speedFor(double way) const {
  const double a = options_.deceleration, t = options_.reaction;
  return std::sqrt(a * a * t * t + 2 * a * std::max(0., way)) - a * t;
}

std::string ObstacleStop::whyNotSeeing(Stamp now) const {
  if (!scan_) return "no scan";
  if (watch_.isOverdue(now)) return fmt::format("no scan for {:.1f} s", watch_.silence(now));
  if (scan_->isBlind()) return "the scan sees nothing at all";
  return "";
}

ObstacleStop::Found ObstacleStop::look(const PlanarPose& T_odom_base,
                                       const SweptPath& path) const {
  const PlanarPose T_base_odom = inverse(T_odom_base);
  const auto wayAmong = [&](const std::vector<FloorPoint>& points_odom, double clearance) {
    std::vector<FloorPoint> points;
    points.reserve(points_odom.size());
    for (const FloorPoint& p : points_odom) points.push_back(transformed(T_base_odom, p));
    return freeWay(path, options_.footprint, clearance, points);
  };
  const FreeWay things = wayAmong(obstacles_, options_.clearance);
  const FreeWay walkers = wayAmong(walkers_, options_.clearance + options_.walker);
  return walkers.way < things.way ? Found{walkers, true} : Found{things, false};
}

ObstacleStop::Verdict ObstacleStop::goOrWait(const Moment& moment, const SweptPath& path,
                                             const SweptPath& sent) {
  Verdict verdict;
  verdict.speed = kFastest;
  verdict.reason = whyNotSeeing(moment.now);
  if (!verdict.reason.empty()) {
    verdict.kind = Verdict::Kind::Wait;
    if (!is_waiting_) wait_.distance = std::numeric_limits<double>::infinity();
    return verdict;
  }
  const Found ahead = look(moment.T_odom_base, path), beyond = look(moment.T_odom_base, sent);
  const auto& [free, is_moving] = beyond.free.way < ahead.free.way ? beyond : ahead;
  if (free.obstacle) {
    verdict.distance = free.distance;
    verdict.speed = std::min(kFastest, speedFor(free.way));
    const bool is_barred = verdict.speed < kCreeping || (is_waiting_ && free.way < kFreeAgain);
    const FloorPoint place = transformed(moment.T_track_base, *free.obstacle);
    verdict.reason = fmt::format("something {} {:.2f} m from it, at ({:.2f}, {:.2f}) in {}",
                                 is_moving ? "moves" : "stands", std::max(0., free.distance),
                                 place.x, place.y, frame_);
    if (is_barred) verdict.kind = Verdict::Kind::Wait;
    if (is_barred && !is_waiting_) wait_ = {0, free.distance, place, moment.at};
  }
  if (!isSeen(path, options_.footprint, *scan_)) {
    verdict.is_unseen = true;
    verdict.speed = std::min(verdict.speed, options_.unseen_speed);
  }
  return verdict;
}

ObstacleStop::Verdict ObstacleStop::judge(const Moment& moment, const SweptPath& path,
                                          const SweptPath& sent) {
  Verdict verdict = goOrWait(moment, path, sent);
  const bool is_free = verdict.kind == Verdict::Kind::Go;
  free_for_ = is_free ? free_for_ + moment.seconds : 0;
  if (is_free && is_waiting_ && free_for_ < kFreeFor) {
    verdict.kind = Verdict::Kind::Wait;
    verdict.reason = reason_;
  }
  keep(verdict, moment);
  if (!is_waiting_) {
    verdict.reason.clear();
    return verdict;
  }
  verdict.speed = 0;
  verdict.waited = wait_.seconds;
  if (wait_.seconds <= options_.patience) return verdict;
  verdict.kind = Verdict::Kind::GiveUp;
  verdict.reason += options_.patience > 0
                        ? fmt::format("; that is so for {:.3g} s", options_.patience)
                        : "; nothing waits for the base";
  return verdict;
}

/// Keeps the verdict for the report, and for the next time.
void ObstacleStop::keep(const Verdict& verdict, const Moment& moment) {
  const bool was_waiting = std::exchange(is_waiting_, verdict.kind != Verdict::Kind::Go);
  if (is_waiting_) {
    wait_.seconds = was_waiting ? wait_.seconds + moment.seconds : 0;
    if (!was_waiting) wait_.at = moment.at;
    reason_ = verdict.reason;
    report_.waited += moment.seconds;
  } else if (was_waiting && report_.waits.size() < ObstacleReport::kMost) {
    report_.waits.push_back(wait_);
  }
  if (!is_waiting_ && verdict.is_unseen && last_pose_) {
    report_.unseen += distance(*last_pose_, moment.T_odom_base);
  }
  last_pose_ = moment.T_odom_base;
}

ObstacleReport ObstacleStop::report() const {
  ObstacleReport report = report_;
  if (is_waiting_) report.waits.push_back(wait_);
  return report;
}

void ObstacleStop::rest() {
  if (is_waiting_ && report_.waits.size() < ObstacleReport::kMost) report_.waits.push_back(wait_);
  is_waiting_ = false;
  free_for_ = 0;
}

}  // namespace afterglow::replay

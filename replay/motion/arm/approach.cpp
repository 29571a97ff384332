#include "replay/motion/arm/approach.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <utility>

#include "replay/messages/document.hpp"
#include "replay/motion/goal_remainder.hpp"
#include "replay/plan/permission.hpp"

namespace afterglow::replay {
namespace {

using Pose = std::vector<double>;

constexpr std::int64_t kLookNs = 40'000'000;
constexpr double kStillKnown = 1;  // s after the base's last pose
/// The share of the free way: farther off again by so much, the recorded way has passed the joints.
constexpr double kPassed = 0.1;
/// Poses that lie so near to the line between others are not bends; of the free way: 0.01 rad.
constexpr double kOnLine = 0.05;
/// The greatest acceleration of a way from rest to rest, times the squared time over the way.
constexpr double kCubicAcceleration = 6;
/// The step between poses that are asked for, as a share of the free way: 0.05 rad.
constexpr double kCheckStep = 0.25;
/// The acceleration at the rests on a way; many of them must not shake the arm.
constexpr double kAcceleration = 1;  // rad/s^2
constexpr double kShortestGoal = 1;  // s

/// Joint by joint `share` of the way.
Pose mixed(const Pose& from, const Pose& to, double share) {
  Pose pose = from;
  for (std::size_t i = 0; i < pose.size(); ++i) pose[i] += share * (to[i] - from[i]);
  return pose;
}

/// Returns where on the line the pose is nearest, by the joint that goes farthest on it.
double shareOf(const Pose& from, const Pose& to, const Pose& pose) {
  double farthest = 0, share = 0;
  for (std::size_t i = 0; i < pose.size(); ++i) {
    const double way = to[i] - from[i];
    if (std::abs(way) <= farthest) continue;
    farthest = std::abs(way);
    share = (pose[i] - from[i]) / way;
  }
  return std::clamp(share, 0.0, 1.0);
}

/// Marks the poses between two that are bends of the way (Douglas and Peucker 1973).
template <typename Distance>
void markBends(const std::vector<Pose>& poses, const Distance& distance, std::size_t first,
               std::size_t last, std::vector<bool>& is_bend) {
  double most = kOnLine;
  std::size_t bend = first;
  for (std::size_t i = first + 1; i < last; ++i) {
    const double share = shareOf(poses[first], poses[last], poses[i]);
    const double off = distance(poses[i], mixed(poses[first], poses[last], share));
    if (off > most) {
      most = off;
      bend = i;
    }
  }
  if (bend == first) return;
  is_bend[bend] = true;
  markBends(poses, distance, first, bend, is_bend);
  markBends(poses, distance, bend, last, is_bend);
}

/// Makes a point to be there, standing, after so long.
Value restPoint(const Value& like, const JointWay::Rest& rest, double seconds) {
  Value point = like;
  valueAt(point, "positions") = numberArray(rest.positions);
  valueAt(point, "velocities") = numberArray(Pose(rest.positions.size()));
  valueAt(point, "accelerations") = numberArray({});
  valueAt(point, "effort") = numberArray({});
  valueAt(point, "time_from_start") = toRosDuration(std::llround(seconds * 1e9));
  return point;
}

/// The gap between both fingers.
double gap(const RobotJoints& robot, const StartPose& pose) {
  double sum = 0;
  for (const auto& [joint, position] : pose.joints) {
    if (robot.isGripper(joint)) sum += position;
  }
  return sum;
}

/// Empty if a position is not known, or no joint deviates.
std::optional<JointWay::Kind> aimTrajectory(Value& goal, const StartPose& then,
                                            const StartPose& now, const StartTolerances& tolerances,
                                            const Approach& approach, Stamp at,
                                            const PoseCheck& check) {
  const auto trajectory = trajectoryIn(goal);
  if (!trajectory || trajectory->points->empty()) return std::nullopt;
  bool deviates = false;
  Pose from, to;
  for (const std::string& joint : trajectory->joints) {
    const auto end = then.joints.find(joint), begin = now.joints.find(joint);
    if (end == then.joints.end() || begin == now.joints.end()) return std::nullopt;
    const double off = then.robot.way(joint, end->second, begin->second);
    deviates = deviates || std::abs(off) > toleranceOf(then.robot, joint, tolerances);
    to.push_back(end->second);
    // A joint without an end is as many turns on as where it goes.
    from.push_back(end->second + off);
  }
  if (!deviates) return std::nullopt;
  const JointWay way = approach.wayTo(trajectory->joints, from, to, at, check);
  const Value like = trajectory->points->front();
  // Without the first one Fetch's controllers would jump after a cancel (arm_start.hpp).
  trajectory->points->clear();
  for (const JointWay::Rest& rest : way.rests) {
    const bool is_end = &rest == &way.rests.back();
    trajectory->points->push_back(
        restPoint(like, rest, is_end ? std::max(kShortestGoal, rest.at_s) : rest.at_s));
  }
  valueAt(goal, "goal.trajectory.header.stamp") = RosTime{};
  return way.kind;
}

}  // namespace

double Approach::speedOf(const std::string& joint) const {
  const double speed = rules_.speed.of(rules_.robot, joint);
  return std::min(speed, rules_.limits.of(joint).velocity.value_or(speed));
}

/// Returns the share of the joint that is farthest off: 1 is as far as it may go straight.
double Approach::shareOfFree(const Names& joints, const Pose& from, const Pose& to) const {
  double share = 0;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const bool slides = rules_.robot.isSliding(joints[i]);
    const double free = slides ? bounds_.free_sliding : bounds_.free_turning;
    share = std::max(share, std::abs(to[i] - from[i]) / free);
  }
  return share;
}

/// Returns the recorded pose, with joints that turn without an end as many turns on as `near`.
std::optional<Approach::Pose> Approach::recordedPose(const Names& joints, Stamp at,
                                                     const Pose& near) const {
  Pose pose;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const auto reach = recorded_.around(joints[i], at, 0);
    if (!reach) return std::nullopt;
    pose.push_back(near[i] + rules_.robot.way(joints[i], near[i], reach->at));
  }
  return pose;
}

/// Returns true if the base stood elsewhere than at the moment, or nobody knows: before the first
/// pose, after the last.
bool Approach::hasBaseMoved(Stamp then, Stamp at) const {
  if (!base_) return false;
  const Stamp last = later(base_->end(), kStillKnown);
  if (std::min(then, at) < base_->begin() || last < std::max(then, at)) return true;
  const PlanarPose way = between(base_->at(then), base_->at(at));
  return std::hypot(way.x, way.y) > rules_.tolerances.base ||
         std::abs(way.yaw) > rules_.tolerances.base_turn;
}

/// The poses of a recorded way, `from` and `to` included; empty: there is none. It is looked for
/// from its end on, so that the shortest is found.
std::vector<Approach::Pose> Approach::recordedPoses(const Names& joints, const Pose& from,
                                                    const Pose& to, Stamp at,
                                                    Search search) const {
  std::vector<Pose> poses = {to};
  std::size_t joined = 0;
  double nearest = std::numeric_limits<double>::max();
  for (std::int64_t ago = 0; ago <= kLongestRecordedWayNs; ago += kLookNs) {
    const Stamp moment{search == Search::Before ? at.ns - ago : at.ns + ago};
    const std::optional<Pose> pose = recordedPose(joints, moment, poses.back());
    if (!pose) continue;
    // How it went from the one to the other was not recorded.
    if (shareOfFree(joints, *pose, poses.back()) > 1 || hasBaseMoved(moment, at)) break;
    poses.push_back(*pose);
    const double off = shareOfFree(joints, from, *pose);
    if (off <= 1 && off < nearest) {
      nearest = off;
      joined = poses.size();
    } else if (off > nearest + kPassed) {
      break;
    }
  }
  if (joined == 0) return {};
  poses.resize(joined);
  poses.push_back(from);
  std::reverse(poses.begin(), poses.end());
  return poses;
}

std::optional<JointWay> Approach::recordedWay(const Names& joints, const Pose& from,
                                              const Pose& to, Stamp at) const {
  std::optional<JointWay> shortest;
  for (const Search search : {Search::Before, Search::After}) {
    const std::vector<Pose> poses = recordedPoses(joints, from, to, at, search);
    if (poses.empty()) continue;
    JointWay way = timed(joints, poses, JointWay::Kind::Recorded);
    if (!shortest || way.seconds() < shortest->seconds()) shortest = std::move(way);
  }
  return shortest;
}

void Approach::checkBounds(const Names& joints, const JointWay& whole) const {
  double all = 0;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    double way = 0;
    for (std::size_t k = 1; k < whole.rests.size(); ++k) {
      way += std::abs(whole.rests[k].positions[i] - whole.rests[k - 1].positions[i]);
    }
    const bool slides = rules_.robot.isSliding(joints[i]);
    if (!slides) all += way;
    if (way <= (slides ? bounds_.sliding : bounds_.turning)) continue;
    throw ApproachRefused(fmt::format(
        "{} would have to go {:.2f} {} to get there: it goes at most {:.1f} rad, or {:.1f} m, "
        "by itself; the robot has to be brought nearer",
        joints[i], way, slides ? "m" : "rad", bounds_.turning, bounds_.sliding));
  }
  if (all <= bounds_.all_turning) return;
  throw ApproachRefused(fmt::format(
      "its joints would have to go {:.2f} rad altogether to get there: they go at most {:.1f} rad "
      "by themselves; the robot has to be brought nearer",
      all, bounds_.all_turning));
}

double Approach::secondsFor(const Names& joints, const Pose& from, const Pose& to,
                            bool is_whole) const {
  double seconds = 0;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const double way = std::abs(to[i] - from[i]), speed = speedOf(joints[i]);
    seconds = std::max(seconds, kCubicPeak * way / speed);
    const double acceleration = kAcceleration * std::min(1.0, speed / rules_.speed.turning);
    if (!is_whole) seconds = std::max(seconds, std::sqrt(kCubicAcceleration * way / acceleration));
  }
  return seconds;
}

JointWay Approach::timed(const Names& joints, const std::vector<Pose>& poses,
                         JointWay::Kind kind) const {
  JointWay way;
  way.kind = kind;
  std::vector<bool> is_rest(poses.size());
  is_rest.front() = is_rest.back() = true;
  const auto distance = [&](const Pose& a, const Pose& b) { return shareOfFree(joints, a, b); };
  markBends(poses, distance, 0, poses.size() - 1, is_rest);
  const bool is_whole = std::count(is_rest.begin(), is_rest.end(), true) == 2;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!is_rest[i]) continue;
    const double seconds =
        way.rests.empty()
            ? 0
            : way.seconds() + secondsFor(joints, way.rests.back().positions, poses[i], is_whole);
    way.rests.push_back({poses[i], seconds});
  }
  return way;
}

void Approach::refuseUnchecked(const Names& joints, const Pose& from, const Pose& to) const {
  std::multimap<double, std::string, std::greater<>> farthest;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const bool slides = rules_.robot.isSliding(joints[i]);
    const double way = std::abs(to[i] - from[i]);
    if (way <= (slides ? bounds_.free_sliding : bounds_.free_turning)) continue;
    farthest.emplace(way / (slides ? bounds_.free_sliding : bounds_.free_turning),
                     fmt::format("{} by {:.2f} {}", joints[i], way, slides ? "m" : "rad"));
  }
  std::vector<std::string> far;
  for (const auto& [share, joint] : farthest) far.push_back(joint);
  throw ApproachRefused(fmt::format(
      "it would move {} on a way that nobody has checked: none was recorded from near where it "
      "is. By itself a joint goes at most {:.1f} rad or {:.2f} m; --unchecked-approach "
      "(~unchecked_approach) has it go straight",
      someOf(far), bounds_.free_turning, bounds_.free_sliding));
}

void Approach::checkStraight(const Names& joints, const Pose& from, const Pose& to,
                             const PoseCheck& check) const {
  const double steps = std::ceil(shareOfFree(joints, from, to) / kCheckStep);
  for (double step = 1; step <= steps; ++step) {
    const std::string why = check(joints, mixed(from, to, step / steps));
    if (why.empty()) continue;
    throw ApproachRefused(fmt::format(
        "it would move straight, as no other way was recorded, and {:.0f} % of the way on {}",
        100 * step / steps, why));
  }
}

JointWay Approach::wayTo(const Names& joints, const Pose& from, const Pose& to, Stamp at,
                         const PoseCheck& check) const {
  using Kind = JointWay::Kind;
  const std::vector<Pose> straight = {from, to};
  if (shareOfFree(joints, from, to) <= 1) {
    return timed(joints, straight, Kind::Short);
  }
  const std::optional<JointWay> recorded = recordedWay(joints, from, to, at);
  const bool is_checked = !recorded && !rules_.accepts_unchecked;
  if (is_checked && !check) refuseUnchecked(joints, from, to);
  const JointWay way = recorded     ? *recorded
                       : is_checked ? timed(joints, straight, Kind::Checked)
                                    : timed(joints, straight, Kind::Unchecked);
  checkBounds(joints, way);
  if (is_checked) checkStraight(joints, from, to, check);
  return way;
}

std::optional<StartGoal> startGoal(const JointGoals& goals, const StartPose& then,
                                   const StartPose& now, const StartTolerances& tolerances,
                                   const Approach& approach, Stamp at, const std::string& id,
                                   const PoseCheck& check) {
  if (!isGoal(goals.output)) {
    return std::nullopt;
  }
  const Schema schema = Schema::of(goals.output);
  Value goal = decode(schema, goals.first);
  valueAt(goal, "header.stamp") = RosTime{};
  valueAt(goal, "goal_id.stamp") = RosTime{};
  valueAt(goal, "goal_id.id") = id;
  if (isGripperGoal(goals.output)) {
    const double wanted = gap(then.robot, then);
    valueAt(goal, "goal.command.position") = wanted;
    if (std::abs(wanted - gap(then.robot, now)) <= tolerances.gripper) return std::nullopt;
    return StartGoal{encode(schema, goal), JointWay::Kind::Short};
  }
  const auto kind = aimTrajectory(goal, then, now, tolerances, approach, at, check);
  if (!kind) return std::nullopt;
  return StartGoal{encode(schema, goal), *kind};
}

}  // namespace afterglow::replay

#include "nodes/fetch/trajectory_follower.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace afterglow::nodes {
namespace {

using namespace std::chrono_literals;
using Phase = TrajectoryStatus::Phase;

constexpr double kGoalTolerance = 0.02;  ///< Fetch's default
constexpr Nanoseconds kPatience = 600ms;
constexpr Nanoseconds kBraking = 200ms;

bool allFinite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

bool hasSizeOrNone(const std::vector<double>& values, std::size_t size) {
  return values.empty() || values.size() == size;
}

std::string problemWith(const TrajectoryPoint& point, std::size_t joints) {
  if (point.positions.size() != joints || !hasSizeOrNone(point.velocities, joints) ||
      !hasSizeOrNone(point.accelerations, joints))
    return "does not have a value for each joint";
  if (!allFinite(point.positions) || !allFinite(point.velocities) ||
      !allFinite(point.accelerations))
    return "is not finite";
  return "";
}

/// Values in the controller's joint order.
std::vector<double> reorder(const std::vector<double>& values, const std::vector<Joint>& joints,
                            const std::vector<std::string>& names) {
  std::vector<double> result;
  if (values.empty()) return result;
  for (const Joint& joint : joints)
    result.push_back(values[std::find(names.begin(), names.end(), joint.name) - names.begin()]);
  return result;
}

struct Boundary {
  double position, velocity, acceleration;
};

/// Line, cubic or quintic through both ends (Hermite; T: the segment's length, t: since its start).
JointState interpolate(const Boundary& a, const Boundary& b, double T, double t, int degree) {
  const double rise = b.position - a.position;
  if (degree == 1) return {a.position + rise * t / T, rise / T};
  double c[6] = {a.position, a.velocity, 0, 0, 0, 0};
  if (degree == 3) {
    c[2] = (3 * rise - (2 * a.velocity + b.velocity) * T) / (T * T);
    c[3] = (-2 * rise + (a.velocity + b.velocity) * T) / (T * T * T);
  } else {
    c[2] = a.acceleration / 2;
    c[3] = (20 * rise - (8 * b.velocity + 12 * a.velocity) * T -
            (3 * a.acceleration - b.acceleration) * T * T) /
           (2 * std::pow(T, 3));
    c[4] = (-30 * rise + (14 * b.velocity + 16 * a.velocity) * T +
            (3 * a.acceleration - 2 * b.acceleration) * T * T) /
           (2 * std::pow(T, 4));
    c[5] = (12 * rise - 6 * (b.velocity + a.velocity) * T +
            (b.acceleration - a.acceleration) * T * T) /
           (2 * std::pow(T, 5));
  }
  JointState state;
  for (int k = 5; k >= 0; --k) state.position = state.position * t + c[k];
  for (int k = 5; k >= 1; --k) state.velocity = state.velocity * t + k * c[k];
  return state;
}

double at(const std::vector<double>& values, std::size_t i) {
  return i < values.size() ? values[i] : 0;
}

}  // namespace

bool TrajectoryFollower::moves(const std::string& joint) const {
  return std::any_of(joints_.begin(), joints_.end(),
                     [&](const Joint& mine) { return mine.name == joint; });
}

TrajectoryStatus TrajectoryFollower::check(const TrajectoryGoal& goal) const {
  std::set<std::string> mine;
  for (const Joint& joint : joints_) mine.insert(joint.name);
  const std::set<std::string> theirs(goal.joints.begin(), goal.joints.end());
  if (mine != theirs || goal.joints.size() != theirs.size()) {
    std::string names;
    for (const std::string& name : mine) names += " " + name;
    return {Phase::Failed, TrajectoryError::InvalidJoints,
            "joint_names must be this controller's joints:" + names};
  }
  for (std::size_t i = 0; i < goal.points.size(); ++i) {
    std::string problem = problemWith(goal.points[i], joints_.size());
    const Nanoseconds before = i ? goal.points[i - 1].time_from_start : Nanoseconds(-1);
    if (problem.empty() && goal.points[i].time_from_start <= before)
      problem = "is not after the one before";
    if (!problem.empty())
      return {Phase::Failed, TrajectoryError::InvalidGoal,
              "points[" + std::to_string(i) + "] " + problem};
  }
  return {Phase::Running, TrajectoryError::None, ""};
}

void TrajectoryFollower::start(const TrajectoryGoal& goal, const JointStates& now_at,
                               Nanoseconds now) {
  if (goal.points.empty())
    return end({Phase::Succeeded, TrajectoryError::None, "stopped: the trajectory has no points"},
               now_at, now);
  const TrajectoryStatus verdict = check(goal);
  if (verdict.phase == Phase::Failed) return end(verdict, now_at, now);
  const Nanoseconds begin = goal.stamp.count() ? goal.stamp : now;
  if (begin + goal.points.back().time_from_start < now)
    return end({Phase::Failed, TrajectoryError::OldHeaderTimestamp,
                "every point of the trajectory lies in the past"},
               now_at, now);
  takeKnots(goal, begin, now_at, now);
  takeTolerances(goal);
  unwind(now_at);
  status_ = verdict;
}

void TrajectoryFollower::end(const TrajectoryStatus& verdict, const JointStates& now_at,
                             Nanoseconds now) {
  // Joints that another controller moves by now are left to it.
  if (status_.phase == Phase::Running) stop(now_at, now, "");
  status_ = verdict;
}

void TrajectoryFollower::takeKnots(const TrajectoryGoal& goal, Nanoseconds begin,
                                   const JointStates& now_at, Nanoseconds now) {
  Knot here{std::max(begin, now), {}, {}, std::vector<double>(joints_.size(), 0.0)};
  for (const Joint& joint : joints_) {
    here.positions.push_back(now_at.at(joint.name).position);
    here.velocities.push_back(now_at.at(joint.name).velocity);
  }
  knots_ = {here};
  for (const TrajectoryPoint& point : goal.points) {
    if (begin + point.time_from_start < now) continue;
    knots_.push_back({begin + point.time_from_start, reorder(point.positions, joints_, goal.joints),
                      reorder(point.velocities, joints_, goal.joints),
                      reorder(point.accelerations, joints_, goal.joints)});
  }
}

void TrajectoryFollower::takeTolerances(const TrajectoryGoal& goal) {
  path_tolerance_.clear();
  goal_tolerance_.clear();
  for (const Joint& joint : joints_) goal_tolerance_[joint.name] = kGoalTolerance;
  const auto apply = [](const std::vector<JointTolerance>& from,
                        std::map<std::string, double>& to) {
    for (const JointTolerance& tolerance : from) {
      if (tolerance.position > 0) to[tolerance.joint] = tolerance.position;
      if (tolerance.position < 0) to.erase(tolerance.joint);
    }
  };
  apply(goal.path_tolerance, path_tolerance_);
  apply(goal.goal_tolerance, goal_tolerance_);
  patience_ = kPatience + std::max(Nanoseconds(0), goal.goal_time_tolerance);
}

void TrajectoryFollower::unwind(const JointStates& now_at) {
  constexpr double kTurn = 6.28318530717958647692;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (joints_[i].kind != Joint::Kind::Continuous) continue;
    const double off = knots_[1].positions[i] - now_at.at(joints_[i].name).position;
    const double turns = std::round(off / kTurn) * kTurn;
    for (std::size_t k = 1; k < knots_.size(); ++k) knots_[k].positions[i] -= turns;
  }
}

void TrajectoryFollower::stop(const JointStates& now_at, Nanoseconds now, const std::string& why) {
  Knot here{now, {}, {}, {}};
  Knot rest{now + kBraking, {}, {}, {}};
  for (const Joint& joint : joints_) {
    const JointState& state = now_at.at(joint.name);
    here.positions.push_back(state.position);
    here.velocities.push_back(state.velocity);
    // Half of what it would travel: a constant deceleration.
    const double end = state.position + state.velocity * seconds(kBraking) / 2;
    rest.positions.push_back(std::clamp(end, joint.lower, joint.upper));
    rest.velocities.push_back(0);
  }
  knots_ = {here, rest};
  status_ = {Phase::Stopped, TrajectoryError::None, why};
}

void TrajectoryFollower::drop(const std::string& why) {
  if (status_.phase == Phase::Running) status_ = {Phase::Stopped, TrajectoryError::None, why};
  knots_.clear();
  desired_.clear();
}

JointState TrajectoryFollower::sample(std::size_t joint, Nanoseconds now) const {
  if (now >= knots_.back().time) return {knots_.back().positions[joint], 0};
  const auto next = std::find_if(knots_.begin() + 1, knots_.end(),
                                 [&](const Knot& knot) { return knot.time > now; });
  const Knot &b = *next, &a = *(next - 1);
  if (now < a.time) return {a.positions[joint], 0};
  int degree = 1;
  if (!a.velocities.empty() && !b.velocities.empty()) degree = 3;
  if (degree == 3 && !a.accelerations.empty() && !b.accelerations.empty()) degree = 5;
  const auto end = [&](const Knot& knot) {
    return Boundary{knot.positions[joint], at(knot.velocities, joint),
                    at(knot.accelerations, joint)};
  };
  return interpolate(end(a), end(b), seconds(b.time - a.time), seconds(now - a.time), degree);
}

void TrajectoryFollower::step(JointStates& states, Nanoseconds now, Nanoseconds dt) {
  if (knots_.empty()) return;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    JointState& state = states.at(joint.name);
    const JointState wanted = sample(i, now);
    const double furthest = joint.max_velocity * seconds(dt);
    const double before = state.position;
    state.position += std::clamp(wanted.position - before, -furthest, furthest);
    state.position = std::clamp(state.position, joint.lower, joint.upper);
    state.velocity = (state.position - before) / seconds(dt);
    desired_[joint.name] = wanted;
  }
  if (status_.phase == Phase::Running) judge(states, now);
  if (status_.phase != Phase::Running && now >= knots_.back().time + kPatience) knots_.clear();
}

void TrajectoryFollower::judge(const JointStates& states, Nanoseconds now) {
  const auto off = [&](const std::string& joint) {
    return std::abs(states.at(joint).position - desired_.at(joint).position);
  };
  for (const auto& [joint, limit] : path_tolerance_)
    if (moves(joint) && off(joint) > limit)
      return fail(TrajectoryError::PathToleranceViolated, joint + " left its path");
  if (now < knots_.back().time) return;
  for (const auto& [joint, limit] : goal_tolerance_) {
    if (!moves(joint) || off(joint) <= limit) continue;
    if (now <= knots_.back().time + patience_) return;
    return fail(TrajectoryError::GoalToleranceViolated, joint + " did not reach its goal");
  }
  status_ = {Phase::Succeeded, TrajectoryError::None, ""};
}

void TrajectoryFollower::fail(TrajectoryError error, const std::string& text) {
  // Hold where it is: chasing on after a failure is what tolerances are there to prevent.
  knots_.clear();
  status_ = {Phase::Failed, error, text};
}

}  // namespace afterglow::nodes

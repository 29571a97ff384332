#include "nodes/fetch/trajectory_follower.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace afterglow::nodes {
namespace {

using namespace std::chrono_literals;

constexpr double kGoalTolerance = 0.02;
constexpr Nanoseconds kLateness = 600ms;

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
    result.push_back(values[static_cast<std::size_t>(
        std::find(names.begin(), names.end(), joint.name) - names.begin())]);
  return result;
}

/// Down to what both the goal's first point and the one put before it have.
void strip(std::vector<JointKnot>& knots) {
  const bool has_velocities = !knots[0].velocities.empty() && !knots[1].velocities.empty();
  const bool has_accelerations = !knots[0].accelerations.empty() && !knots[1].accelerations.empty();
  for (JointKnot& knot : knots) {
    if (!has_velocities) knot.velocities.clear();
    if (!has_accelerations) knot.accelerations.clear();
  }
}

}  // namespace

std::vector<JointKnot> knotsOf(const TrajectoryGoal& goal, const std::vector<Joint>& joints,
                               Nanoseconds begin) {
  std::vector<JointKnot> knots;
  for (const TrajectoryPoint& point : goal.points)
    knots.push_back({begin + point.time_from_start, reorder(point.positions, joints, goal.joints),
                     reorder(point.velocities, joints, goal.joints),
                     reorder(point.accelerations, joints, goal.joints)});
  return knots;
}

bool TrajectoryFollower::check(const TrajectoryGoal& goal) {
  std::set<std::string> mine;
  for (const Joint& joint : joints()) mine.insert(joint.name);
  const std::set<std::string> theirs(goal.joints.begin(), goal.joints.end());
  if (mine == theirs && goal.joints.size() == theirs.size()) return checkPoints(goal);
  std::string names;
  for (const std::string& name : mine) names += " " + name;
  fail(TrajectoryError::InvalidJoints, "joint_names must be this controller's joints:" + names);
  return false;
}

bool TrajectoryFollower::checkPoints(const TrajectoryGoal& goal) {
  for (std::size_t i = 0; i < goal.points.size(); ++i) {
    std::string problem = problemWith(goal.points[i], joints().size());
    const Nanoseconds before = i ? goal.points[i - 1].time_from_start : Nanoseconds::min();
    if (problem.empty() && goal.points[i].time_from_start < before)
      problem = "is before the one before it";
    if (problem.empty()) continue;
    fail(TrajectoryError::InvalidGoal, "points[" + std::to_string(i) + "] " + problem);
    return false;
  }
  return true;
}

void TrajectoryFollower::start(const TrajectoryGoal& goal, const JointStates& measured,
                               Nanoseconds now) {
  if (goal.points.empty()) {
    fail(TrajectoryError::None, "the trajectory has no points: the controller lets go");
    return letGo("");
  }
  if (!check(goal)) return;
  const Nanoseconds begin = goal.stamp.count() ? goal.stamp : now;
  std::vector<JointKnot> knots = knotsOf(goal, joints(), begin);
  const bool is_later = goal.points[0].time_from_start > 0s || knots[0].time > now;
  if (const std::optional<JointKnot> last = spliceKnot()) {
    knots.insert(knots.begin(), *last);
    strip(knots);
  } else if (is_later || knots.size() == 1) {
    knots.insert(knots.begin(), here(measured, now));
    strip(knots);
  }
  if (takeTolerances(goal)) take(JointPath(std::move(knots), joints()));
}

std::optional<std::vector<double>> TrajectoryFollower::limitsOf(
    const std::vector<JointTolerance>& tolerances, double otherwise) {
  std::vector<double> limits(joints().size(), otherwise);
  if (tolerances.size() != joints().size()) return limits;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const auto found =
        std::find_if(tolerances.begin(), tolerances.end(),
                     [&](const JointTolerance& one) { return one.joint == joints()[i].name; });
    if (found == tolerances.end()) {
      fail(TrajectoryError::InvalidJoints, "there is no tolerance of " + joints()[i].name);
      return std::nullopt;
    }
    limits[i] = found->position;
  }
  return limits;
}

bool TrajectoryFollower::takeTolerances(const TrajectoryGoal& goal) {
  const auto path = limitsOf(goal.path_tolerance, 0);
  const auto end = path ? limitsOf(goal.goal_tolerance, kGoalTolerance) : std::nullopt;
  if (!end) return false;
  path_limits_ = *path;
  goal_limits_ = *end;
  patience_ = kLateness + goal.goal_time_tolerance;
  return true;
}

void TrajectoryFollower::judge(const JointStates& measured, Nanoseconds now) {
  const auto leaving = [&](const std::vector<double>& limits) -> const Joint* {
    for (std::size_t i = 0; i < limits.size(); ++i)
      if (limits[i] > 0 && off(measured, i) > limits[i]) return &joints()[i];
    return nullptr;
  };
  // What was commanded last is held then, however far the joint is: it pushes on.
  if (const Joint* joint = leaving(path_limits_))
    return fail(TrajectoryError::PathToleranceViolated, joint->name + " left its path");
  if (now < path().end()) return;
  const Joint* late = leaving(goal_limits_);
  if (!late) return succeed();
  if (now > path().end() + patience_)
    fail(TrajectoryError::GoalToleranceViolated, late->name + " did not reach its goal");
}

}  // namespace afterglow::nodes

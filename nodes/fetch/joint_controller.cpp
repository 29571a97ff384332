#include "nodes/fetch/joint_controller.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "replay/motion/arm/arm_path.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::nodes {
namespace {

int degreeFrom(const JointKnot& knot) {
  if (!knot.accelerations.empty()) return 5;
  return knot.velocities.empty() ? 1 : 3;
}

replay::JointMotion boundary(const JointKnot& knot, std::size_t joint) {
  const auto at = [&](const std::vector<double>& values) {
    return joint < values.size() ? values[joint] : 0;
  };
  return {knot.positions[joint], at(knot.velocities), at(knot.accelerations)};
}

}  // namespace

double turnBetween(double from, double to) { return replay::wrapAngle(to - from); }

JointPath::JointPath(std::vector<JointKnot> knots, const std::vector<Joint>& joints)
    : knots_(std::move(knots)) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    turns_for_ever_.push_back(joints[i].kind == Joint::Kind::Continuous);
    if (!turns_for_ever_.back()) continue;
    double before = 0;
    for (JointKnot& knot : knots_) {
      knot.positions[i] = before + turnBetween(before, knot.positions[i]);
      before = knot.positions[i];
    }
  }
}

std::optional<JointKnot> JointPath::sample(Nanoseconds now) const {
  // Segment after segment, up to the first that begins later: a knot that lies in the past has been
  // passed, wherever it stands.
  std::size_t begun = 0;
  while (begun + 1 < knots_.size() && knots_[begun].time < now) ++begun;
  if (begun == 0) return std::nullopt;
  const JointKnot &a = knots_[begun - 1], &b = knots_[begun];
  const Nanoseconds at = std::min(now, end());
  const int degree = degreeFrom(a);
  JointKnot found;
  found.time = at;
  for (std::size_t i = 0; i < a.positions.size(); ++i) {
    const replay::JointMotion is =
        interpolate(boundary(a, i), boundary(b, i), seconds(b.time - a.time),
                    seconds(at - a.time), degree);
    found.positions.push_back(turns_for_ever_[i] ? turnBetween(0, is.position) : is.position);
    if (degree > 1) found.velocities.push_back(is.velocity);
    if (degree > 3) found.accelerations.push_back(is.acceleration);
  }
  return found;
}

namespace {

using Ended = TrajectoryStatus::Phase;

}  // namespace

bool JointController::moves(const std::string& joint) const {
  return std::any_of(joints_.begin(), joints_.end(),
                     [&](const Joint& mine) { return mine.name == joint; });
}

JointStates JointController::desired() const {
  JointStates states;
  for (std::size_t i = 0; last_command_ && i < joints_.size(); ++i) {
    const bool has_velocity = isBusy() && !last_command_->velocities.empty();
    states[joints_[i].name] = {last_command_->positions[i],
                               has_velocity ? last_command_->velocities[i] : 0};
  }
  return states;
}

void JointController::cancel() {
  if (!isBusy()) return;
  status_ = {Ended::Stopped, TrajectoryError::None, "canceled"};
  was_canceled_ = true;
}

std::optional<std::vector<double>> JointController::step(const JointStates& measured,
                                                         Nanoseconds now) {
  if (!is_on_) return std::nullopt;
  if (isBusy()) {
    std::optional<JointKnot> command = path_.sample(now);
    if (!command) return std::nullopt;
    last_command_ = std::move(command);
    judge(measured, now);
  }
  if (!last_command_) return std::nullopt;
  return last_command_->positions;
}

void JointController::begin() {
  is_on_ = true;
  was_canceled_ = false;
}

void JointController::refuse(const std::string& why) {
  fail(TrajectoryError::GoalToleranceViolated, why);
}

void JointController::letGo(const std::string& why) {
  if (isBusy()) fail(TrajectoryError::None, why);
  is_on_ = false;
}

void JointController::forget(const std::string& why) {
  if (isBusy()) status_ = {Ended::Stopped, TrajectoryError::None, why};
  is_on_ = was_canceled_ = false;
  last_command_.reset();
}

void JointController::fail(TrajectoryError error, const std::string& why) {
  status_ = {Ended::Failed, error, why};
}

void JointController::take(JointPath path) {
  path_ = std::move(path);
  status_ = {Ended::Running, TrajectoryError::None, ""};
}

double JointController::off(const JointStates& measured, std::size_t joint) const {
  const double is = measured.at(joints_[joint].name).position;
  return std::abs(turnBetween(last_command_->positions[joint], is));
}

JointKnot JointController::here(const JointStates& measured, Nanoseconds now) const {
  JointKnot knot;
  knot.time = now;
  for (const Joint& joint : joints_) knot.positions.push_back(measured.at(joint.name).position);
  knot.velocities = knot.accelerations = std::vector<double>(joints_.size(), 0.0);
  return knot;
}

std::optional<JointKnot> JointController::spliceKnot() const {
  return was_canceled_ ? last_command_ : std::nullopt;
}

void HeadPointer::start(const Turn& turn, const JointStates& measured, Nanoseconds now) {
  JointKnot begin = spliceKnot().value_or(here(measured, now));
  double needed = seconds(turn.min_duration);
  for (std::size_t i = 0; i < joints().size(); ++i) {
    const double limit = joints()[i].max_velocity;
    const double speed = turn.max_velocity > 0 ? std::min(turn.max_velocity, limit) : limit;
    needed = std::max(needed, std::abs(turn.angles[i] - begin.positions[i]) / speed);
  }
  JointKnot end;
  end.time = begin.time + Nanoseconds(std::llround(needed * 1e9));
  end.positions = turn.angles;
  end.velocities = end.accelerations = std::vector<double>(joints().size(), 0.0);
  take(JointPath({std::move(begin), std::move(end)}, joints()));
}

void HeadPointer::judge(const JointStates&, Nanoseconds now) {
  if (now > path().end()) succeed();
}

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

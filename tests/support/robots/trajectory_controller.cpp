#include "tests/support/robots/trajectory_controller.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace afterglow::test {
namespace {

using namespace nodes;
using Kind = ControllerFacts::Kind;

constexpr double kStopped = 0.01;  // stopped_velocity_tolerance's default, rad/s

bool isSized(const std::vector<double>& values, std::size_t size) {
  return values.empty() || values.size() == size;
}

/// Values for each joint, and times that rise.
bool isValid(const std::vector<JointKnot>& knots, std::size_t joints, bool is_strict) {
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const JointKnot& knot = knots[i];
    const bool rises = i == 0 || !is_strict || knots[i - 1].time < knot.time;
    if (!rises || knot.positions.size() != joints || !isSized(knot.velocities, joints) ||
        !isSized(knot.accelerations, joints)) {
      return false;
    }
  }
  return true;
}

/// > 0 replaces, < 0 removes, 0 leaves the controller's own; the tests' goals have one for all.
double chosen(const std::vector<JointTolerance>& asked, double own) {
  if (asked.empty() || asked.front().position == 0) return own;
  return std::max(0.0, asked.front().position);
}

}  // namespace

TrajectoryController::TrajectoryController(const ControllerFacts& facts, std::vector<Joint> joints,
                                           const JointStates& measured)
    : facts_(facts), joints_(std::move(joints)) {
  begin(measured);
}

JointKnot TrajectoryController::measuredKnot(const JointStates& measured) const {
  JointKnot knot;
  knot.time = time_;
  for (const Joint& joint : joints_) knot.positions.push_back(measured.at(joint.name).position);
  knot.velocities = knot.accelerations = std::vector<double>(joints_.size());
  return knot;
}

void TrajectoryController::stand(JointKnot knot) {
  knot.time = time_ - Nanoseconds(1);
  JointKnot end = knot;
  end.time = end_ = time_;
  path_ = JointPath({std::move(knot), std::move(end)}, joints_);
  begin_ = Nanoseconds::min();
}

void TrajectoryController::begin(const JointStates& measured) {
  stand(measuredKnot(measured));
  desired_ = measuredKnot(measured);
}

void TrajectoryController::hold(const JointStates& measured) {
  if (facts_.kind == Kind::Pr2 || facts_.stop_duration == 0) return stand(measuredKnot(measured));
  // From the desired state to where half of a way there and back would turn.
  const Nanoseconds duration(std::llround(facts_.stop_duration * 1e9));
  JointKnot from = at(time_), back = from;
  from.accelerations.assign(joints_.size(), 0);
  back.accelerations = from.accelerations;
  back.time = time_ + 2 * duration;
  for (double& velocity : back.velocities) velocity = -velocity;
  JointKnot end = *JointPath({from, back}, joints_).sample(time_ + duration);
  end.velocities.assign(joints_.size(), 0);
  end.accelerations = end.velocities;
  end_ = end.time;
  path_ = JointPath({from, end}, joints_);
  begin_ = Nanoseconds::min();
}

/// With velocities and accelerations, which are 0 once the path is over.
JointKnot TrajectoryController::at(Nanoseconds time) const {
  const bool has_begun = time > begin_;  // where it begins both are at one place, or one steps
  const JointPath& path = has_begun ? path_ : before_;
  JointKnot knot = path.sample(time).value_or(desired_);
  knot.time = time;
  const bool is_over = has_begun && time > end_;
  if (is_over || knot.velocities.empty()) {
    knot.velocities.assign(joints_.size(), 0);
    // On a line: a controller's spline knows its slope.
    const auto later = is_over ? std::nullopt : path.sample(time + kCycle);
    for (std::size_t i = 0; later && i < joints_.size(); ++i) {
      knot.velocities[i] =
          turnBetween(knot.positions[i], later->positions[i]) / nodes::seconds(kCycle);
    }
  }
  if (is_over || knot.accelerations.empty()) knot.accelerations.assign(joints_.size(), 0);
  return knot;
}

TrajectoryController::Answer TrajectoryController::follow(const TrajectoryGoal& goal,
                                                          Nanoseconds now) {
  std::set<std::string> mine;
  for (const Joint& joint : joints_) mine.insert(joint.name);
  const bool is_mine = goal.joints.size() == mine.size() &&
                       std::set<std::string>(goal.joints.begin(), goal.joints.end()) == mine;
  if (!is_mine) return Answer::OtherJoints;
  const Nanoseconds next = time_ + kCycle;
  const Nanoseconds begin = goal.stamp.count() ? time_ + (goal.stamp - now) : next;
  const bool is_strict = facts_.kind == Kind::RosControl;
  for (const TrajectoryPoint& point : goal.points) {
    if (point.positions.size() != joints_.size()) return Answer::Invalid;
  }
  std::vector<JointKnot> knots = knotsOf(goal, joints_, begin);
  if (!isValid(knots, joints_.size(), is_strict)) return Answer::Invalid;
  if (is_strict) {
    knots.erase(knots.begin(),
                std::find_if(knots.begin(), knots.end(),
                             [&](const JointKnot& knot) { return knot.time > next; }));
  }
  if (knots.empty()) return Answer::Invalid;
  const Nanoseconds splice = is_strict ? std::max(begin, next) : begin;
  JointKnot from = at(splice);
  if (knots.front().velocities.empty()) from.velocities.clear();
  if (knots.front().accelerations.empty()) from.accelerations.clear();
  knots.insert(knots.begin(), std::move(from));
  before_ = std::exchange(path_, JointPath(knots, joints_));
  begin_ = splice;
  end_ = knots.back().time;
  path_tolerance_ = chosen(goal.path_tolerance, facts_.path_tolerance);
  goal_tolerance_ = chosen(goal.goal_tolerance, facts_.goal_tolerance);
  goal_time_ = goal.goal_time_tolerance.count() ? nodes::seconds(goal.goal_time_tolerance)
                                                : facts_.goal_time;
  return Answer::Accepted;
}

bool TrajectoryController::isMissing(const JointStates& measured, double tolerance) const {
  for (std::size_t i = 0; tolerance > 0 && i < joints_.size(); ++i) {
    const double is = measured.at(joints_[i].name).position;
    if (std::abs(turnBetween(desired_.positions[i], is)) > tolerance) return true;
  }
  return false;
}

TrajectoryController::Event TrajectoryController::step(const JointStates& measured, double scale) {
  time_ += Nanoseconds(std::llround(static_cast<double>(kCycle.count()) * scale));
  desired_ = at(time_);
  if (time_ < begin_) return Event::None;
  if (time_ < end_) {
    return isMissing(measured, path_tolerance_) ? Event::LeftPath : Event::None;
  }
  const bool is_moving = std::any_of(joints_.begin(), joints_.end(), [&](const Joint& joint) {
    return std::abs(measured.at(joint.name).velocity) > kStopped;
  });
  if (!isMissing(measured, goal_tolerance_) && !is_moving) return Event::Reached;
  return nodes::seconds(time_ - end_) >= goal_time_ ? Event::MissedGoal : Event::None;
}

}  // namespace afterglow::test

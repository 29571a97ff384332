#include "nodes/fetch/joint_controller.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace afterglow::nodes

#include "nodes/fetch/joint_controller.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::nodes {
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

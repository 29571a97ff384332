#include "nodes/fetch/fake_fetch.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "nodes/fetch/fetch_facts.hpp"

namespace afterglow::nodes {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kStep = 10ms;
constexpr Nanoseconds kLongestSleep =
    10s;  ///< a machine may stall; a clock that leaps further was set
constexpr double kWidestGap = 0.1;
constexpr double kGapTolerance = 0.002;
constexpr double kStallDistance = 0.005;
constexpr Nanoseconds kStallTime = 2s;
constexpr double kHandSpeed = 1.0;  // rad/s

std::vector<Joint> jointsOf(const RobotModel& model, const std::vector<std::string>& names) {
  std::vector<Joint> joints;
  for (const std::string& name : names) joints.push_back(model.joint(name));
  return joints;
}

/// Arm tucked, everything else at rest, gripper closed.
JointStates startJoints(const RobotModel& model) {
  JointStates states;
  for (const auto& [name, position] : model.restPositions()) states[name] = {position, 0};
  for (const auto& [name, position] : tuckedArm()) states.at(name).position = position;
  return states;
}

TrajectoryGoal slowedDown(TrajectoryGoal goal, double slowness) {
  for (TrajectoryPoint& point : goal.points) {
    point.time_from_start =
        Nanoseconds(std::llround(static_cast<double>(point.time_from_start.count()) * slowness));
    for (double& velocity : point.velocities) velocity /= slowness;
    for (double& acceleration : point.accelerations) acceleration /= slowness * slowness;
  }
  return goal;
}

}  // namespace

FakeFetch::FakeFetch(RobotModel model, const FakeFetchConfig& config, Nanoseconds now)
    : model_(std::move(model)),
      config_(config),
      base_(config.start, config.errors),
      localization_(config.localization, base_),
      joints_(startJoints(model_)),
      head_pointer_(jointsOf(model_, kHeadJoints)),
      now_(now) {
  const auto add = [&](const char* name, const std::vector<std::string>& joints) {
    followers_.emplace(name, TrajectoryFollower(jointsOf(model_, joints)));
  };
  add(kArmController, kArmJoints);
  add(kArmWithTorsoController, kArmWithTorsoJoints);
  add(kTorsoController, {"torso_lift_joint"});
  add(kHeadController, kHeadJoints);
  add(kProjectorController, kProjectorJoints);
}

void FakeFetch::step(Nanoseconds now) {
  if (now < now_ || now - now_ > kLongestSleep) {
    stopEverything("the clock jumped");
    now_ = now;
  }
  while (now_ + kStep <= now) stepOnce();
}

void FakeFetch::stepOnce() {
  now_ += kStep;
  const JointStates measured = joints_;
  for (auto& [name, state] : joints_) state.velocity = 0;
  const JointPositions before = std::exchange(commands_.positions, {});
  for (JointController* controller : controllers())
    if (const auto positions = controller->step(measured, now_))
      obey(*controller, *positions, before);
  moveHandled();
  moveFingers();
  base_.step(now_, kStep);
  localization_.step(now_, base_);
  turnWheels();
}

// ------------------------------------------------------------------------------------- controllers
TrajectoryFollower& FakeFetch::follower(const std::string& name) {
  const auto found = followers_.find(name);
  if (found == followers_.end()) throw std::out_of_range("there is no controller " + name);
  return found->second;
}

const JointController& FakeFetch::controller(const std::string& name) const {
  if (name == kPointHeadController) return head_pointer_;
  return const_cast<FakeFetch*>(this)->follower(name);
}

std::vector<JointController*> FakeFetch::controllers() {
  std::vector<JointController*> all = {&head_pointer_};
  for (auto& [name, follower] : followers_) all.push_back(&follower);
  return all;
}

void FakeFetch::startController(JointController& taker) {
  for (JointController* other : controllers()) {
    if (other == &taker || !other->isOn()) continue;
    const auto shared =
        std::find_if(taker.joints().begin(), taker.joints().end(),
                     [&](const Joint& joint) { return other->moves(joint.name); });
    if (shared == taker.joints().end()) continue;
    if (other->isBusy())
      return taker.refuse("cannot start: another controller is busy with " + shared->name);
    other->yield();
  }
  taker.begin();
  for (const Joint& joint : taker.joints()) in_hand_.erase(joint.name);
}

void FakeFetch::follow(const std::string& controller, const TrajectoryGoal& goal) {
  TrajectoryFollower& taker = follower(controller);
  taker.start(slowedDown(goal, config_.slowness), joints_, now_);
  if (taker.isBusy()) startController(taker);
}

void FakeFetch::pointHead(const Eigen::Vector3d& p_base, Nanoseconds duration,
                          double max_velocity) {
  const Joint& pan = model_.joint("head_pan_joint");
  const auto seenFrom = [&](const std::string& link) -> Eigen::Vector3d {
    return model_.linkPose(link, jointPositions()).inverse() * p_base;
  };
  const Eigen::Vector3d p_torso = seenFrom(pan.parent), p_pan = seenFrom(pan.child);
  HeadPointer::Turn turn;
  turn.angles = {std::atan2(p_torso.y(), p_torso.x()),
                 -std::atan2(p_pan.z(), p_pan.head(2).norm())};
  turn.min_duration =
      Nanoseconds(std::llround(static_cast<double>(duration.count()) * config_.slowness));
  turn.max_velocity = max_velocity;
  head_pointer_.start(turn, joints_, now_);
  startController(head_pointer_);
}

void FakeFetch::cancel(const std::string& controller) {
  const_cast<JointController&>(this->controller(controller)).cancel();
}

/// Moves joints as their motors do at once, as far as they can within a cycle.
void FakeFetch::obey(const JointController& controller, const std::vector<double>& positions,
                     const JointPositions& before) {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Joint& joint = controller.joints()[i];
    const bool turns_for_ever = joint.kind == Joint::Kind::Continuous;
    const auto way = [&](double from) {
      return turns_for_ever ? turnBetween(from, positions[i]) : positions[i] - from;
    };
    JointState& state = joints_.at(joint.name);
    const double was = state.position;
    const auto command_before = before.find(joint.name);
    const double step = way(command_before != before.end() ? command_before->second : was);
    double& largest_step = commands_.largest_steps[joint.name];
    largest_step = std::max(largest_step, std::abs(step));
    commands_.positions[joint.name] = positions[i];
    const double furthest = joint.max_velocity * seconds(kStep);
    state.position += std::clamp(way(was), -furthest, furthest);
    state.position = std::clamp(state.position, joint.lower, joint.upper);
    state.velocity = (state.position - was) / seconds(kStep);
  }
}

JointCommands FakeFetch::takeCommands() {
  JointCommands taken = commands_;
  commands_.largest_steps.clear();
  return taken;
}

// --------------------------------------------------------------------------------- somebody's hand
void FakeFetch::moveByHand(const JointPositions& positions) {
  for (const auto& [name, position] : positions) {
    const Joint& joint = model_.joint(name);
    if (!joint.moves() || !std::isfinite(position)) continue;
    for (JointController* controller : controllers())
      if (controller->moves(name)) controller->letGo("the controllers were switched off");
    in_hand_[name] = std::clamp(position, joint.lower, joint.upper);
  }
}

void FakeFetch::moveHandled() {
  for (auto moved = in_hand_.begin(); moved != in_hand_.end();) {
    JointState& state = joints_.at(moved->first);
    const double most = kHandSpeed * seconds(kStep);
    const double move = std::clamp(moved->second - state.position, -most, most);
    state.position += move;
    state.velocity = move / seconds(kStep);
    moved = state.position == moved->second ? in_hand_.erase(moved) : std::next(moved);
  }
}

// ------------------------------------------------------------------------------------- the gripper
void FakeFetch::moveGripper(double gap) {
  goal_gap_ = gap;
  wanted_gap_ = std::clamp(gap, 0.0, kWidestGap);
  grip_ = {gripper().gap, false, false, false};
  watched_gap_ = grip_.gap;
  watched_since_ = now_;
}

GripperStatus FakeFetch::gripper() const {
  GripperStatus status = grip_;
  status.gap = 0;
  for (const std::string& name : kGripperJoints) status.gap += joints_.at(name).position;
  return status;
}

void FakeFetch::moveFingers() {
  for (const std::string& name : kGripperJoints) {
    JointState& finger = joints_.at(name);
    const double most = model_.joint(name).max_velocity * seconds(kStep);
    const double move = std::clamp(wanted_gap_ / 2 - finger.position, -most, most);
    finger.position += move;
    finger.velocity = move / seconds(kStep);
  }
  if (!grip_.is_done) watchGrip();
}

void FakeFetch::watchGrip() {
  const double gap = gripper().gap;
  if (std::abs(gap - watched_gap_) > kStallDistance) {
    watched_gap_ = gap;
    watched_since_ = now_;
  }
  // The gap that was asked for, even if it is wider than the gripper opens.
  grip_.reached = std::abs(gap - goal_gap_) < kGapTolerance;
  grip_.stalled = !grip_.reached && now_ - watched_since_ > kStallTime;
  grip_.is_done = grip_.reached || grip_.stalled;
}

void FakeFetch::turnWheels() {
  joints_.at("l_wheel_joint").position = base_.leftWheel();
  joints_.at("r_wheel_joint").position = base_.rightWheel();
  // The bellows hang half-way between the torso's ends.
  joints_.at("bellows_joint").position = joints_.at("torso_lift_joint").position / 2;
}

void FakeFetch::stopEverything(const std::string& why) {
  for (JointController* controller : controllers()) controller->forget(why);
  in_hand_.clear();
  commands_ = {};
  wanted_gap_ = gripper().gap;
  grip_.is_done = true;
  base_.halt();
}

void FakeFetch::reset() {
  stopEverything("the robot was reset");
  joints_ = startJoints(model_);
  wanted_gap_ = 0;
  base_.place(config_.start);
  localization_.relocate(base_);
  turnWheels();
}

JointPositions FakeFetch::jointPositions() const {
  JointPositions positions;
  for (const auto& [name, state] : joints_) positions[name] = state.position;
  return positions;
}

}  // namespace afterglow::nodes

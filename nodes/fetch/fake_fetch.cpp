#include "nodes/fetch/fake_fetch.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nodes/fetch/fetch_facts.hpp"

namespace afterglow::nodes {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kStep = 10ms;
constexpr Nanoseconds kLongestSleep =
    10s;  ///< a machine may stall; a clock that leaps further was set
constexpr double kWidestGap = 0.1;
constexpr double kGapTolerance = 0.001;

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
      now_(now) {
  const auto add = [&](const char* name, const std::vector<std::string>& joints) {
    followers_.emplace(name, TrajectoryFollower(jointsOf(model_, joints)));
  };
  add(kArmWithTorsoController, kArmWithTorsoJoints);
  add(kTorsoController, {"torso_lift_joint"});
  add(kHeadController, kHeadJoints);
  add(kPointHeadController, kHeadJoints);
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
  for (auto& [name, state] : joints_) state.velocity = 0;
  for (auto& [name, follower] : followers_) follower.step(joints_, now_, kStep);
  moveFingers();
  base_.step(now_, kStep);
  localization_.step(now_, base_);
  turnWheels();
}

TrajectoryFollower& FakeFetch::follower(const std::string& name) {
  const auto found = followers_.find(name);
  if (found == followers_.end()) throw std::out_of_range("there is no controller " + name);
  return found->second;
}

const TrajectoryFollower& FakeFetch::controller(const std::string& name) const {
  return const_cast<FakeFetch*>(this)->follower(name);
}

void FakeFetch::takeJointsFrom(const TrajectoryFollower& taker, const std::string& taker_name) {
  for (auto& [name, other] : followers_) {
    if (&other == &taker) continue;
    for (const Joint& joint : taker.joints()) {
      if (!other.moves(joint.name)) continue;
      other.drop(taker_name + " took " + joint.name + " over");
      break;
    }
  }
}

void FakeFetch::follow(const std::string& controller, const TrajectoryGoal& goal) {
  TrajectoryFollower& taker = follower(controller);
  taker.start(slowedDown(goal, config_.slowness), joints_, now_);
  if (taker.status().phase == TrajectoryStatus::Phase::Running) takeJointsFrom(taker, controller);
}

bool FakeFetch::pointHead(const Eigen::Vector3d& p_base, Nanoseconds duration,
                          double max_velocity) {
  const auto angles = model_.aim(kHeadTurret, Eigen::Vector3d::UnitX(), p_base, jointPositions());
  if (!angles) return false;
  TrajectoryGoal goal;
  TrajectoryPoint point;
  double needed = seconds(duration);
  for (const std::string& name : kHeadJoints) {
    const double limit = model_.joint(name).max_velocity;
    const double speed = max_velocity > 0 ? std::min(max_velocity, limit) : limit;
    // 1.5: the peak of a cubic from rest to rest is that much above its mean.
    needed = std::max(needed, 1.5 * std::abs(angles->at(name) - joints_.at(name).position) / speed);
    goal.joints.push_back(name);
    point.positions.push_back(angles->at(name));
    point.velocities.push_back(0);
  }
  point.time_from_start = kStep + Nanoseconds(static_cast<std::int64_t>(needed * 1e9));
  goal.points = {point};
  follow(kPointHeadController, goal);
  return true;
}

void FakeFetch::stop(const std::string& controller) {
  TrajectoryFollower& stopped = follower(controller);
  if (stopped.status().phase == TrajectoryStatus::Phase::Running)
    stopped.stop(joints_, now_, "stopped");
}

void FakeFetch::moveGripper(double gap) { wanted_gap_ = std::clamp(gap, 0.0, kWidestGap); }

void FakeFetch::stopGripper() { wanted_gap_ = gripper().gap; }

GripperStatus FakeFetch::gripper() const {
  double gap = 0;
  for (const std::string& name : kGripperJoints) gap += joints_.at(name).position;
  return {gap, std::abs(gap - wanted_gap_) < kGapTolerance};
}

void FakeFetch::moveFingers() {
  for (const std::string& name : kGripperJoints) {
    JointState& finger = joints_.at(name);
    const double most = model_.joint(name).max_velocity * seconds(kStep);
    const double move = std::clamp(wanted_gap_ / 2 - finger.position, -most, most);
    finger.position += move;
    finger.velocity = move / seconds(kStep);
  }
}

void FakeFetch::turnWheels() {
  joints_.at("l_wheel_joint").position = base_.leftWheel();
  joints_.at("r_wheel_joint").position = base_.rightWheel();
  // The bellows hang half-way between the torso's ends.
  joints_.at("bellows_joint").position = joints_.at("torso_lift_joint").position / 2;
}

void FakeFetch::stopEverything(const std::string& why) {
  for (auto& [name, follower] : followers_) follower.drop(why);
  stopGripper();
  base_.halt();
}

void FakeFetch::reset() {
  stopEverything("the robot was reset");
  joints_ = startJoints(model_);
  wanted_gap_ = 0;
  base_.place(config_.start);
  turnWheels();
}

JointPositions FakeFetch::jointPositions() const {
  JointPositions positions;
  for (const auto& [name, state] : joints_) positions[name] = state.position;
  return positions;
}

}  // namespace afterglow::nodes

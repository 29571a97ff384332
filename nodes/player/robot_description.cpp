#include "nodes/player/robot_description.hpp"

#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "nodes/player/ros_clock.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/messages/ranges.hpp"
#include "replay/plan/permission.hpp"
#include "replay/record/snapshot.hpp"

namespace afterglow::nodes {
namespace {

using replay::RobotJoint;

RobotJoint describedJoint(const urdf::Joint& joint) {
  RobotJoint described;
  described.kind = joint.type == urdf::Joint::PRISMATIC    ? RobotJoint::Kind::Sliding
                   : joint.type == urdf::Joint::CONTINUOUS ? RobotJoint::Kind::Endless
                                                           : RobotJoint::Kind::Turning;
  if (joint.limits && joint.limits->velocity > 0) described.fastest = joint.limits->velocity;
  const bool ends = joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::PRISMATIC;
  if (ends && joint.limits && joint.limits->lower < joint.limits->upper) {
    described.range = {joint.limits->lower, joint.limits->upper};
  }
  if (joint.mimic) {
    described.mimic = replay::MimicJoint{joint.mimic->joint_name, joint.mimic->multiplier,
                                         joint.mimic->offset};
  }
  return described;
}

}  // namespace

replay::RobotJoints readRobotJoints(const std::string& urdf, const replay::RobotProfile& robot) {
  std::map<std::string, RobotJoint> joints;
  const urdf::ModelInterfaceSharedPtr model =
      urdf.empty() ? urdf::ModelInterfaceSharedPtr() : urdf::parseURDF(urdf);
  if (!model) return {"", {}, robot.gripper_joints};
  for (const auto& [name, joint] : model->joints_) {
    if (joint->type != urdf::Joint::FIXED) joints.emplace(name, describedJoint(*joint));
  }
  return {model->getName(), std::move(joints), robot.gripper_joints};
}

std::string recordedDescription(const replay::Store& store, const replay::Behavior& behavior) {
  const std::string hash = replay::recordedUrdf(behavior);
  const auto text = hash.empty() ? std::nullopt : store.file(hash);
  return text ? std::string(text->begin(), text->end()) : std::string();
}

replay::RobotJoints recordedJoints(const replay::Store& store, const replay::Behavior& behavior,
                                   const replay::RobotProfile& robot) {
  return readRobotJoints(recordedDescription(store, behavior), robot);
}

replay::RobotJoints liveDescription(const std::string& name_space,
                                    const replay::RobotProfile& robot) {
  return readRobotJoints(robotParameter(name_space, "robot_description"), robot);
}

std::vector<std::string> recordedTopics(const replay::Store& store,
                                        const replay::Behavior& behavior,
                                        const std::vector<std::string>& types,
                                        const std::string& usual) {
  const replay::RobotNames robot = replay::recordedRobot(behavior).value_or(replay::RobotNames());
  std::set<std::string> topics;
  for (const auto& known : {store.topics(behavior), store.contextTopics(behavior)}) {
    for (const replay::TopicSummary& topic : known) {
      const std::string& name = topic.topic;
      const bool is_called_so = replay::endsWith(name, usual);
      const bool is_of_type = replay::contains(types, topic.type);
      const bool is_own = robot.topic(name) == name;
      if (is_called_so && is_of_type && is_own) topics.insert(name);
    }
  }
  if (topics.empty()) topics.insert(robot.topic(usual));
  return {topics.begin(), topics.end()};
}

std::string liveName(const replay::PlayPlan& plan, const replay::PlanOptions& names,
                     const std::string& recorded) {
  if (replay::contains(plan.playedTopics(), recorded)) return recorded;
  const auto name = replay::TopicName::cleaned(recorded);
  return name ? publishedName(*name, names).text() : recorded;
}

namespace {

constexpr double kJointLook = 0.02;  // s

}  // namespace

LiveJoints::LiveJoints(const std::vector<std::string>& topics) {
  for (const std::string& topic : topics) {
    thread_.hear<sensor_msgs::JointState>(topic, 100,
                                          [this](const auto& message) { onJoints(message); });
  }
  thread_.begin();
}

std::optional<replay::LiveJoint> LiveJoints::find(const std::string& joint) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto told = joints_.find(joint);
  const bool is_fresh = told != joints_.end() && !told->second.watch.isOverdue(robotNow());
  return is_fresh ? std::optional(told->second.joint) : std::nullopt;
}

void LiveJoints::watch(std::function<std::vector<std::string>()> moving,
                       std::function<void(const std::string&)> on_silence) {
  const auto look = [this, moving = std::move(moving), on_silence = std::move(on_silence)] {
    std::vector<std::string> silent;
    for (const std::string& joint : moving()) {
      const std::lock_guard<std::mutex> lock(mutex_);
      const auto told = joints_.find(joint);
      const bool is_silent = told != joints_.end() && told->second.watch.isOverdue(robotNow());
      if (is_silent) silent.push_back(joint);
    }
    if (silent.empty()) return;
    timer_.stop();
    on_silence("joint states fell silent in motion: nobody tells where " +
               replay::someOf(silent) + " is");
  };
  timer_ = thread_.every(kJointLook, look);
}

std::map<std::string, double> LiveJoints::positions() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::map<std::string, double> positions;
  for (const auto& [name, told] : joints_) positions[name] = told.joint.position;
  return positions;
}

void LiveJoints::onJoints(const sensor_msgs::JointState& message) {
  const replay::SteadyTime now = robotNow();
  const std::lock_guard<std::mutex> lock(mutex_);
  for (std::size_t i = 0; i < std::min(message.name.size(), message.position.size()); ++i) {
    if (!std::isfinite(message.position[i])) continue;
    const double velocity = i < message.velocity.size() ? message.velocity[i] : 0;
    Told& told = joints_[message.name[i]];
    told.joint = {message.position[i], std::isfinite(velocity) ? velocity : 0};
    told.watch.heard(now);
  }
}

}  // namespace afterglow::nodes

#include "tests/support/robots/robot_node.hpp"

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TwistStamped.h>
#include <nav_msgs/Odometry.h>
#include <std_msgs/Bool.h>
#include <std_msgs/Float64.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/fetch/robot_messages.hpp"
#include "replay/messages/definitions.hpp"
#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::test {
namespace {

using namespace nodes;
using Result = control_msgs::FollowJointTrajectoryResult;

constexpr double kCycle = 0.01;        // s
constexpr Nanoseconds kPublishPeriod{20'000'000};
/// Motors follow their commands so much later, s.
constexpr double kLag = 0.03;
/// A limp gripper gives way to what it holds, m/s.
constexpr double kGivesWay = 0.02;
constexpr DriveFaults kWheels{1.004, 0.997, 0.01, 0.05, 0.4};

std::vector<Joint> jointsOf(const RobotModel& model, const std::vector<std::string>& names) {
  std::vector<Joint> joints;
  for (const std::string& name : names) joints.push_back(model.joint(name));
  return joints;
}

JointStates restOf(const RobotModel& model) {
  JointStates states;
  for (const auto& [name, position] : model.restPositions()) states[name] = {position, 0};
  return states;
}

Result resultOf(int code) {
  Result result;
  result.error_code = code;
  return result;
}

}  // namespace

// ------------------------------------------------------------------------------------ controllers
ControllerTopics::ControllerTopics(const ControllerFacts& facts, const RobotModel& model,
                                   const JointStates& joints)
    : name_(facts.name), controller_(facts, jointsOf(model, facts.joints), joints), joints_(joints) {
  command_ = node_.subscribe("/" + facts.name + "/command", 1, &ControllerTopics::onCommand, this);
  server_ = std::make_unique<Server>(
      node_, "/" + facts.name + "/follow_joint_trajectory",
      [this](Server::GoalHandle goal) { onGoal(std::move(goal)); },
      [this](Server::GoalHandle goal) { onCancel(std::move(goal)); }, false);
  server_->start();
}

void ControllerTopics::preempt() {
  if (goal_) goal_->setCanceled();
  goal_.reset();
}

void ControllerTopics::onGoal(Server::GoalHandle goal) {
  if (!is_running_) return goal.setRejected(resultOf(Result::INVALID_GOAL));
  TrajectoryGoal wanted = toGoal(*goal.getGoal());
  using Answer = TrajectoryController::Answer;
  const Answer answer = wanted.points.empty()
                            ? Answer::Accepted
                            : controller_.follow(wanted, toNanoseconds(ros::Time::now()));
  if (answer != Answer::Accepted) {
    return goal.setRejected(resultOf(
        answer == Answer::OtherJoints ? Result::INVALID_JOINTS : Result::INVALID_GOAL));
  }
  if (wanted.points.empty()) controller_.hold(joints_);
  preempt();
  goal.setAccepted();
  goal_ = std::move(goal);
}

void ControllerTopics::onCancel(Server::GoalHandle goal) {
  if (!goal_ || !(*goal_ == goal)) return;
  controller_.hold(joints_);
  preempt();
}

void ControllerTopics::onCommand(const trajectory_msgs::JointTrajectory& command) {
  if (!is_running_) return;
  if (command.points.empty()) {
    controller_.hold(joints_);
  } else if (controller_.follow(toGoal(command), toNanoseconds(ros::Time::now())) !=
             TrajectoryController::Answer::Accepted) {
    return;
  }
  preempt();
}

void ControllerTopics::step(double scale) {
  using Event = TrajectoryController::Event;
  const Event event = controller_.step(joints_, scale);
  if (!goal_ || event == Event::None) return;
  if (event == Event::Reached) goal_->setSucceeded(resultOf(Result::SUCCESSFUL));
  if (event == Event::LeftPath) goal_->setAborted(resultOf(Result::PATH_TOLERANCE_VIOLATED));
  if (event == Event::MissedGoal) goal_->setAborted(resultOf(Result::GOAL_TOLERANCE_VIOLATED));
  goal_.reset();
}

void ControllerTopics::stop() {
  is_running_ = false;
  preempt();
}

void ControllerTopics::start() {
  controller_.begin(joints_);
  is_running_ = true;
}

// ------------------------------------------------------------------------------- gripper and stop
LimpGripper::LimpGripper(const GripperFacts& facts, JointState& joint)
    : facts_(facts), joint_(joint), wanted_(joint.position) {
  server_ = std::make_unique<Server>(
      node_, facts.action, [this](Server::GoalHandle goal) { onGoal(std::move(goal)); },
      [this](Server::GoalHandle goal) {
        if (!goal_ || !(*goal_ == goal)) return;
        wanted_.reset();
        goal_->setCanceled();
        goal_.reset();
      },
      false);
  server_->start();
}

void LimpGripper::onGoal(Server::GoalHandle goal) {
  if (goal_) goal_->setCanceled();
  const auto& command = goal.getGoal()->command;
  wanted_.reset();
  if (command.max_effort != 0) wanted_ = std::clamp(command.position, 0., facts_.widest);
  goal.setAccepted();
  goal_ = std::move(goal);
}

void LimpGripper::step() {
  const double speed = wanted_ ? facts_.speed : kGivesWay;
  const double move = std::clamp(wanted_.value_or(facts_.widest) - joint_.position,
                                 -speed * kCycle, speed * kCycle);
  joint_.position += move;
  joint_.velocity = move / kCycle;
  if (!goal_ || !wanted_ || joint_.position != *wanted_) return;
  control_msgs::GripperCommandResult result;
  result.position = joint_.position;
  result.reached_goal = true;
  goal_->setSucceeded(result);
  goal_.reset();
}

void LimpGripper::reset() {
  if (goal_) goal_->setCanceled();
  goal_.reset();
  wanted_ = joint_.position;
}

StopTopic::StopTopic(const StopFacts& facts) : facts_(facts) {
  message_.morph(replay::definitionMd5(facts.type, facts.definition), facts.type, facts.definition,
                 "");
  const bool is_latched = facts.period == 0;
  publisher_ = message_.advertise(node_, facts.topic, 10, is_latched);
  publish();
  if (is_latched) return;
  timer_ = node_.createWallTimer(ros::WallDuration(facts.period),
                                 [this](const ros::WallTimerEvent&) { publish(); });
}

void StopTopic::press(bool is_pressed) {
  is_pressed_ = is_pressed;
  publish();
}

void StopTopic::publish() {
  const replay::Schema schema = replay::Schema::parse(facts_.type, facts_.definition);
  replay::Value value = decode(schema, replay::Bytes(schema.minimumSize(0)));
  valueAt(value, facts_.field) = replay::BoolByte{is_pressed_ == facts_.stops_when};
  replay::Bytes bytes = encode(schema, value);
  ros::serialization::IStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  message_.read(stream);
  publisher_.publish(message_);
}

// -------------------------------------------------------------------------------------- the robot
RobotNode::RobotNode(const RobotFacts& facts)
    : facts_(facts),
      model_(RobotModel::fromXml(facts.description(), facts.name)),
      joints_(restOf(model_)),
      start_(toNanoseconds(ros::Time::now())),
      now_(start_) {
  node_.setParam("/robot_description", facts_.description());
  joints_publisher_ = node_.advertise<sensor_msgs::JointState>("/joint_states", 10);
  commands_publisher_ = private_node_.advertise<sensor_msgs::JointState>("commands", 50);
  for (const ControllerFacts& controller : facts_.controllers) {
    controllers_.push_back(std::make_unique<ControllerTopics>(controller, model_, joints_));
  }
  if (facts_.gripper) gripper_.emplace(*facts_.gripper, joints_.at(facts_.gripper->joint));
  if (facts_.stop) stop_.emplace(*facts_.stop);
  subscribers_ = {
      private_node_.subscribe<std_msgs::Bool>(
          "press", 1, [this](const auto& word) { onPress(word->data != 0); }),
      private_node_.subscribe<std_msgs::String>("switch_off", 1,
                                                [this](const auto& name) {
                                                  for (const auto& controller : controllers_) {
                                                    if (controller->name() == name->data) {
                                                      controller->stop();
                                                    }
                                                  }
                                                }),
      private_node_.subscribe<std_msgs::String>(
          "hinder", 1, [this](const auto& joint) { hindered_ = joint->data; }),
      private_node_.subscribe<std_msgs::Float64>(
          "speed_scale", 1, [this](const auto& scale) { speed_scale_ = scale->data; })};
  if (facts_.has_speed_scale) {
    scale_publisher_ = node_.advertise<std_msgs::Float64>("/speed_scaling_factor", 10);
  }
  if (const auto& base = facts_.base) {
    odometry_publisher_ = node_.advertise<nav_msgs::Odometry>(base->odometry_topic, 10);
    truth_publisher_ = private_node_.advertise<geometry_msgs::PoseStamped>("true_pose", 10);
    if (!base->echo_topic.empty()) {
      echo_publisher_ = node_.advertise<geometry_msgs::TwistStamped>(base->echo_topic, 10);
    }
    laser_.emplace(PlanarPose(), Eigen::Isometry3d::Identity(), base->scan);
    static_tf_.sendTransform(stamped(base->base_frame, base->scan.frame,
                                     Eigen::Isometry3d::Identity(), toRosTime(now_)));
    subscribers_.push_back(node_.subscribe(base->command_topic, 1, &RobotNode::onTwist, this));
  }
  putBack();
  reset_service_ = private_node_.advertiseService("reset", &RobotNode::reset, this);
  const bool is_managed =
      std::any_of(facts_.controllers.begin(), facts_.controllers.end(), [](const auto& controller) {
        return controller.kind == ControllerFacts::Kind::RosControl;
      });
  if (is_managed) {
    manager_service_ = node_.advertiseService("/controller_manager/list_controllers",
                                              &RobotNode::listControllers, this);
  }
  timer_ = node_.createWallTimer(ros::WallDuration(kCycle),
                                 [this](const ros::WallTimerEvent&) { onTimer(); });
}

void RobotNode::onTwist(const geometry_msgs::Twist& twist) {
  drive_->command(seconds(), {twist.linear.x, twist.angular.z, twist.linear.y});
  if (!echo_publisher_) return;
  geometry_msgs::TwistStamped echo;
  echo.header.stamp = toRosTime(now_);
  echo.twist = twist;
  echo_publisher_.publish(echo);
}

/// Power that is cut leaves the controllers running: back again, the joints go to where they are
/// commanded by then.
void RobotNode::onPress(bool is_pressed) {
  const bool was_pressed = stop_->isPressed();
  stop_->press(is_pressed);
  if (!stop_->facts().stops_controllers || is_pressed == was_pressed) return;
  for (const auto& controller : controllers_) {
    if (is_pressed) controller->stop();
    if (!is_pressed) controller->start();
  }
}

bool RobotNode::reset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  putBack();
  response.success = true;
  return true;
}

bool RobotNode::listControllers(controller_manager_msgs::ListControllers::Request&,
                                controller_manager_msgs::ListControllers::Response& response) {
  for (const auto& controller : controllers_) {
    response.controller.emplace_back();
    response.controller.back().name = controller->name();
    response.controller.back().state = controller->isRunning() ? "running" : "stopped";
  }
  return true;
}

void RobotNode::putBack() {
  for (auto& [name, state] : joints_) {
    const Joint& joint = model_.joint(name);
    state = {positionOf(joint, {}), 0};
  }
  for (const auto& controller : controllers_) {
    controller->stop();
    controller->start();
  }
  if (gripper_) gripper_->reset();
  hindered_.clear();
  speed_scale_ = 1;
  if (stop_ && stop_->isPressed()) onPress(false);
  if (!facts_.base) return;
  DriveFaults wheels = kWheels;
  wheels.manners = facts_.base->manners;
  drive_.emplace(PlanarPose(), PlanarPose{1, -2, 0.5}, wheels, 1);
  localization_.emplace(LocalizationFaults(), 2);
}

void RobotNode::onTimer() {
  const Nanoseconds now = toNanoseconds(ros::Time::now());
  while (now_ + TrajectoryController::kCycle <= now) step();
  if (laser_) laser_->publishIfDue(toRosTime(now_), drive_->truth());
  if (now_ - published_ >= kPublishPeriod) publish();
}

void RobotNode::step() {
  now_ += TrajectoryController::kCycle;
  for (const auto& topics : controllers_) {
    const TrajectoryController& controller = topics->controller();
    const bool has_power = !stop_ || !stop_->isPressed();
    if (topics->isRunning()) {
      const std::vector<double> before = controller.desired();
      topics->step(speed_scale_);
      noteCommands(controller, before);
    }
    moveJoints(controller, has_power && topics->isRunning());
  }
  if (gripper_) gripper_->step();
  if (!drive_) return;
  drive_->is_stuck = stop_ && stop_->isPressed();
  drive_->step(seconds());
  (void)localization_->look(seconds(), *drive_);
}

void RobotNode::noteCommands(const TrajectoryController& controller,
                             const std::vector<double>& before) {
  for (std::size_t i = 0; i < before.size(); ++i) {
    const std::string& name = controller.joints()[i].name;
    const double now = controller.desired()[i];
    const double speed = std::abs(turnBetween(before[i], now)) / kCycle;
    const auto found = std::find(commands_.name.begin(), commands_.name.end(), name);
    const auto at = static_cast<std::size_t>(found - commands_.name.begin());
    if (found == commands_.name.end()) {
      commands_.name.push_back(name);
      commands_.position.push_back(now);
      commands_.velocity.push_back(speed);
    } else {
      commands_.position[at] = now;
      commands_.velocity[at] = std::max(commands_.velocity[at], speed);
    }
  }
}

/// Motors follow with a lag, but not in somebody's hand.
void RobotNode::moveJoints(const TrajectoryController& controller, bool is_driven) {
  for (std::size_t i = 0; i < controller.joints().size(); ++i) {
    const std::string& name = controller.joints()[i].name;
    JointState& state = joints_.at(name);
    const double share = is_driven && name != hindered_ ? 1 - std::exp(-kCycle / kLag) : 0;
    const double move = turnBetween(state.position, controller.desired()[i]) * share;
    state.position += move;
    state.velocity = move / kCycle;
  }
}

// --------------------------------------------------------------------------------- what it tells
void RobotNode::publish() {
  published_ = now_;
  publishJoints();
  if (drive_) publishBase();
  if (!scale_publisher_) return;
  std_msgs::Float64 scale;
  scale.data = speed_scale_;
  scale_publisher_.publish(scale);
}

/// All in one message, by name, as ros_control's do.
void RobotNode::publishJoints() {
  sensor_msgs::JointState message;
  message.header.stamp = commands_.header.stamp = toRosTime(now_);
  for (const auto& [name, state] : joints_) {
    message.name.push_back(name);
    message.position.push_back(state.position);
    message.velocity.push_back(state.velocity);
    message.effort.push_back(0);
  }
  if (!message.name.empty()) joints_publisher_.publish(message);
  commands_publisher_.publish(std::exchange(commands_, {}));
}

void RobotNode::publishBase() {
  const BaseFacts& base = *facts_.base;
  const ros::Time stamp = toRosTime(now_);
  const auto heard = localization_->look(seconds(), *drive_);
  std::vector<geometry_msgs::TransformStamped> poses = {stamped(
      base.odometry_frame, base.base_frame, toIsometry(drive_->odometry()), stamp)};
  if (heard) poses.push_back(stamped("map", base.odometry_frame, toIsometry(heard->pose), stamp));
  tf_.sendTransform(poses);
  nav_msgs::Odometry odometry;
  odometry.header.stamp = stamp;
  odometry.header.frame_id = base.odometry_frame;
  odometry.child_frame_id = base.base_frame;
  odometry.pose.pose = poseMessage(drive_->odometry());
  odometry.twist.twist.linear.x = drive_->velocity().forward;
  odometry.twist.twist.linear.y = drive_->velocity().left;
  odometry.twist.twist.angular.z = drive_->velocity().turn;
  odometry_publisher_.publish(odometry);
  geometry_msgs::PoseStamped truth;
  truth.header.stamp = stamp;
  truth.header.frame_id = "map";
  truth.pose = poseMessage(drive_->truth());
  truth_publisher_.publish(truth);
}

}  // namespace afterglow::test

#include "nodes/fetch/fake_fetch_node.hpp"

#include <geometry_msgs/PoseStamped.h>
#include <nav_msgs/Odometry.h>
#include <tf2/exceptions.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/fetch/fetch_facts.hpp"
#include "nodes/fetch/robot_messages.hpp"
#include "nodes/tools/ros_graph.hpp"

namespace afterglow::nodes {
namespace {

using Phase = TrajectoryStatus::Phase;

constexpr double kStepPeriod_s = 0.01;
constexpr double kPublishPeriod_s = 0.02;
constexpr double kFeedbackPeriod_s = 0.02;

/// The order of the real robot's /joint_states; the gripper has messages of its own there.
const std::vector<std::string> kBodyJoints = {
    "l_wheel_joint",       "r_wheel_joint",       "torso_lift_joint",    "bellows_joint",
    "head_pan_joint",      "head_tilt_joint",     "shoulder_pan_joint",  "shoulder_lift_joint",
    "upperarm_roll_joint", "elbow_flex_joint",    "forearm_roll_joint",  "wrist_flex_joint",
    "wrist_roll_joint",    "projector_pan_joint", "projector_tilt_joint"};

void append(trajectory_msgs::JointTrajectoryPoint& point, double position, double velocity) {
  point.positions.push_back(position);
  point.velocities.push_back(velocity);
}

control_msgs::FollowJointTrajectoryResult toResult(const TrajectoryStatus& status) {
  control_msgs::FollowJointTrajectoryResult result;
  result.error_code = static_cast<std::int32_t>(status.error);
  result.error_string = status.text;
  return result;
}

control_msgs::FollowJointTrajectoryFeedback toFeedback(const JointController& controller,
                                                       const JointStates& actual, Nanoseconds now) {
  control_msgs::FollowJointTrajectoryFeedback feedback;
  feedback.header.stamp = toRosTime(now);
  const JointStates desired = controller.desired();
  for (const Joint& joint : controller.joints()) {
    const auto wanted = desired.find(joint.name);
    const JointState is = actual.at(joint.name);
    const JointState should = wanted != desired.end() ? wanted->second : is;
    feedback.joint_names.push_back(joint.name);
    append(feedback.desired, should.position, should.velocity);
    append(feedback.actual, is.position, is.velocity);
    append(feedback.error, should.position - is.position, should.velocity - is.velocity);
  }
  return feedback;
}

sensor_msgs::JointState jointMessage(const std::vector<std::string>& names,
                                     const JointStates& states, const ros::Time& stamp) {
  sensor_msgs::JointState message;
  message.header.stamp = stamp;
  for (const std::string& name : names) {
    message.name.push_back(name);
    message.position.push_back(states.at(name).position);
    message.velocity.push_back(states.at(name).velocity);
    message.effort.push_back(0);
  }
  return message;
}

double readNumber(const ros::NodeHandle& node, const std::string& name, double otherwise) {
  if (!node.hasParam(name)) return otherwise;
  double value = 0;
  if (!node.getParam(name, value) || !std::isfinite(value))
    throw std::runtime_error("parameter " + node.resolveName(name) + " must be a finite number");
  return value;
}

/// Waits between looks at a running goal. Wall time: with a paused /clock goals can still be
/// canceled.
void waitABit() { ros::WallDuration(kFeedbackPeriod_s).sleep(); }

}  // namespace

RobotModel readRobotDescription(const ros::NodeHandle& node) {
  const std::string xml = robotParameter(rosNamespace(), "robot_description");
  if (xml.empty())
    throw std::runtime_error("parameter " + node.resolveName("robot_description") +
                             " is not set; nodes/launch/fake_fetch.launch sets it");
  RobotModel model = RobotModel::fromXml(xml, "robot_description");
  try {
    for (const std::string& name : kBodyJoints) model.joint(name);
    for (const std::string& name : kGripperJoints) model.joint(name);
    model.linkPose(kHeadTurret.frame, {});
  } catch (const std::out_of_range& error) {
    throw std::runtime_error(std::string("robot_description is not a Fetch: ") + error.what());
  }
  return model;
}

FakeFetchConfig readFakeFetchConfig(const ros::NodeHandle& private_node) {
  FakeFetchConfig config;
  const auto read = [&](const char* name, double& value) {
    value = readNumber(private_node, name, value);
  };
  read("x", config.start.x);
  read("y", config.start.y);
  read("yaw", config.start.yaw);
  read("linear_scale", config.errors.linear_scale);
  read("angular_scale", config.errors.angular_scale);
  read("slip", config.errors.slip);
  const auto readPositive = [&](const char* name, double& value, bool may_be_zero) {
    read(name, value);
    if (value < 0 || (value == 0 && !may_be_zero))
      throw std::runtime_error("parameter " + private_node.resolveName(name) + " must not be " +
                               (may_be_zero ? "below 0" : "0 or less"));
  };
  readPositive("localization_error", config.localization.position, true);
  readPositive("localization_yaw_error", config.localization.yaw, true);
  readPositive("localization_distance", config.localization.distance, true);
  readPositive("localization_turn", config.localization.turn, true);
  readPositive("slowness", config.slowness, false);
  double latency_s = 0;
  readPositive("latency", latency_s, true);
  config.errors.latency = Nanoseconds(std::llround(latency_s * 1e9));
  config.errors.seed =
      static_cast<std::uint32_t>(std::abs(readNumber(private_node, "seed", config.errors.seed)));
  config.localization.seed = config.errors.seed + 1;
  return config;
}

FakeFetchNode::FakeFetchNode(RobotModel model, const FakeFetchConfig& config)
    : names_{rosNamespace(), robotParameter(rosNamespace(), "tf_prefix")},
      robot_(std::move(model), config, toNanoseconds(ros::Time::now())),
      tf_listener_(tf_),
      runstop_([this] { locked([](FakeFetch& robot) { robot.cutPower(); }); }),
      point_head_server_(
          node_, "head_controller/point_head",
          [this](const control_msgs::PointHeadGoalConstPtr& goal) { pointHead(*goal); }, false),
      gripper_server_(
          node_, "gripper_controller/gripper_action",
          [this](const control_msgs::GripperCommandGoalConstPtr& goal) { moveGripper(*goal); },
          false) {
  joints_publisher_ = node_.advertise<sensor_msgs::JointState>("joint_states", 10);
  odometry_publisher_ = node_.advertise<nav_msgs::Odometry>("odom", 10);
  truth_publisher_ = private_node_.advertise<geometry_msgs::PoseStamped>("true_pose", 10);
  commands_publisher_ = private_node_.advertise<sensor_msgs::JointState>("commands", 50);
  publishFixedLinks();
  publish();
  if (private_node_.param("scan", true)) {
    laser_ = std::make_unique<LaserTopics>(config.start,
                                           robot_.model().linkPose("laser_link", {}),
                                           ScanTopic{"base_scan", names_.frame("laser_link")});
    obstacles_subscriber_ =
        node_.subscribe("/obstacles", 2, &FakeFetchNode::onObstacles, this);
  }
  // Queue of one: the latest velocity wins.
  twist_subscriber_ = node_.subscribe(VelocityMux::output(), 1, &FakeFetchNode::onTwist, this);
  hand_subscriber_ = private_node_.subscribe("hand", 10, &FakeFetchNode::onHand, this);
  mute_subscriber_ = private_node_.subscribe<std_msgs::Bool>(
      "mute", 1, [this](const auto& word) { is_mute_ = word->data != 0; });
  reset_service_ = private_node_.advertiseService("reset", &FakeFetchNode::onReset, this);
  for (const char* controller :
       {kArmController, kArmWithTorsoController, kTorsoController, kHeadController,
        kProjectorController})
    addTrajectoryServer(controller);
  // Only now: a goal that comes in at once must find the list complete.
  for (const auto& server : trajectory_servers_) server->start();
  point_head_server_.start();
  gripper_server_.start();
  timer_ = node_.createWallTimer(ros::WallDuration(kStepPeriod_s),
                                 [this](const ros::WallTimerEvent&) { onTimer(); });
}

FakeFetchNode::~FakeFetchNode() {
  is_closing_ = true;  // the servers' threads are joined by their destructors
  timer_.stop();
}

bool FakeFetchNode::isOpen() const { return ros::ok() && !is_closing_; }

// ------------------------------------------------------------------------------ joint trajectories
void FakeFetchNode::addTrajectoryServer(const std::string& controller) {
  const std::size_t index = trajectory_servers_.size();
  trajectory_servers_.push_back(std::make_unique<TrajectoryServer>(
      node_, controller + "/follow_joint_trajectory",
      [this, index, controller](const control_msgs::FollowJointTrajectoryGoalConstPtr& goal) {
        follow(*trajectory_servers_[index], controller, *goal);
      },
      false));
}

TrajectoryStatus FakeFetchNode::waitForEnd(const std::string& controller,
                                           const std::function<bool()>& is_canceled,
                                           const std::function<void()>& each_time) {
  for (;;) {
    const TrajectoryStatus status =
        locked([&](FakeFetch& robot) { return robot.controller(controller).status(); });
    if (status.phase != Phase::Running) return status;
    if (is_canceled() || !isOpen()) break;
    each_time();
    waitABit();
  }
  return locked([&](FakeFetch& robot) {
    const TrajectoryStatus status = robot.controller(controller).status();
    robot.cancel(controller);
    return status;
  });
}

void FakeFetchNode::follow(TrajectoryServer& server, const std::string& controller,
                           const control_msgs::FollowJointTrajectoryGoal& goal) {
  locked([&](FakeFetch& robot) {
    robot.step(toNanoseconds(ros::Time::now()));
    robot.follow(controller, toGoal(goal));
  });
  const TrajectoryStatus end = waitForEnd(
      controller, [&] { return server.isPreemptRequested(); },
      [&] {
        server.publishFeedback(locked([&](FakeFetch& robot) {
          return toFeedback(robot.controller(controller), robot.joints(), robot.now());
        }));
      });
  if (end.phase == Phase::Succeeded) return server.setSucceeded(toResult(end), end.text);
  if (end.phase != Phase::Running) return server.setAborted(toResult(end), end.text);
  server.setPreempted(toResult(end), "preempted");
}

// -------------------------------------------------------------------------------- head and gripper
bool FakeFetchNode::startPointing(const control_msgs::PointHeadGoal& goal, std::string* problem) {
  Eigen::Vector3d p_base(goal.target.point.x, goal.target.point.y, goal.target.point.z);
  try {
    // The latest transform, whatever the stamp, as the real controller does.
    p_base = toIsometry(tf_.lookupTransform(names_.frame("base_link"), frameName(goal.target.header.frame_id),
                                            ros::Time(0))
                            .transform) *
             p_base;
  } catch (const tf2::TransformException& error) {
    *problem = error.what();
    return false;
  }
  *problem = "the target is not finite";
  if (!p_base.allFinite()) return false;
  locked([&](FakeFetch& robot) {
    robot.step(toNanoseconds(ros::Time::now()));
    robot.pointHead(p_base, toNanoseconds(goal.min_duration), goal.max_velocity);
  });
  return true;
}

void FakeFetchNode::pointHead(const control_msgs::PointHeadGoal& goal) {
  std::string problem;
  if (!startPointing(goal, &problem))
    return point_head_server_.setAborted(control_msgs::PointHeadResult(), problem);
  const TrajectoryStatus end = waitForEnd(
      kPointHeadController, [this] { return point_head_server_.isPreemptRequested(); }, [] {});
  if (end.phase == Phase::Succeeded) return point_head_server_.setSucceeded();
  if (end.phase == Phase::Running) return point_head_server_.setPreempted();
  point_head_server_.setAborted(control_msgs::PointHeadResult(), end.text);
}

void FakeFetchNode::moveGripper(const control_msgs::GripperCommandGoal& goal) {
  control_msgs::GripperCommandResult result;
  if (!std::isfinite(goal.command.position))
    return gripper_server_.setAborted(result, "position is not finite");
  const auto look = [this] { return locked([](FakeFetch& robot) { return robot.gripper(); }); };
  locked([&](FakeFetch& robot) { robot.moveGripper(goal.command.position); });
  while (!look().is_done && !gripper_server_.isPreemptRequested() && isOpen()) {
    control_msgs::GripperCommandFeedback feedback;
    feedback.position = look().gap;
    gripper_server_.publishFeedback(feedback);
    waitABit();
  }
  const GripperStatus end = look();
  result.position = end.gap;
  result.reached_goal = end.reached;
  result.stalled = end.stalled;
  if (end.is_done) return gripper_server_.setSucceeded(result);
  gripper_server_.setPreempted(result);  // the fingers go on
}

// ---------------------------------------------------------------------------------- base and reset
void FakeFetchNode::onTwist(const geometry_msgs::Twist& twist) {
  if (runstop_.isPressed()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!robot_.drive(twist.linear.x, twist.angular.z))
    ROS_WARN_THROTTLE(1, "a velocity that is not finite, ignored");
}

void FakeFetchNode::onHand(const sensor_msgs::JointState& message) {
  JointPositions positions;
  for (std::size_t i = 0; i < std::min(message.name.size(), message.position.size()); ++i)
    positions[message.name[i]] = message.position[i];
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    robot_.moveByHand(positions);
  } catch (const std::out_of_range& error) {
    ROS_WARN_STREAM("~hand: " << error.what());
  }
}

void FakeFetchNode::onObstacles(const geometry_msgs::PoseArray& obstacles) {
  const std::lock_guard<std::mutex> lock(mutex_);
  laser_->setThings(obstacles);
}

bool FakeFetchNode::onReset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  robot_.reset();
  response.success = true;
  response.message = "at the start pose";
  return true;
}

// ----------------------------------------------------------------------------------- what it tells
void FakeFetchNode::onTimer() {
  const std::lock_guard<std::mutex> lock(mutex_);
  robot_.step(toNanoseconds(ros::Time::now()));
  const ros::Duration since = toRosTime(robot_.now()) - published_;
  // The same stamp twice is an error to tf; a clock set back starts anew.
  if (since >= ros::Duration(kPublishPeriod_s) || since < ros::Duration(0)) publish();
  if (laser_) laser_->publishIfDue(toRosTime(robot_.now()), robot_.base().truePose());
}

void FakeFetchNode::publish() {
  published_ = toRosTime(robot_.now());
  publishTransforms(published_);
  publishJoints(published_);
  publishCommands(published_);
  publishOdometry(published_);
  publishTruth(published_);
}

void FakeFetchNode::publishTransforms(const ros::Time& stamp) {
  const DiffDrive& base = robot_.base();
  std::vector<geometry_msgs::TransformStamped> transforms = {
      stamped("map", names_.frame("odom"), toIsometry(robot_.mapToOdom()), stamp),
      stamped(names_.frame("odom"), names_.frame(robot_.model().rootLink()),
              toIsometry(base.odometry()), stamp)};
  for (const Joint& joint : robot_.model().joints()) {
    if (!joint.moves()) continue;
    const double position = robot_.joints().at(joint.name).position;
    transforms.push_back(stamped(names_.frame(joint.parent), names_.frame(joint.child),
                                 joint.T_parent_child(position), stamp));
  }
  tf_broadcaster_.sendTransform(transforms);
}

void FakeFetchNode::publishFixedLinks() {
  std::vector<geometry_msgs::TransformStamped> transforms;
  for (const Joint& joint : robot_.model().joints())
    if (!joint.moves())
      transforms.push_back(
          stamped(names_.frame(joint.parent), names_.frame(joint.child), joint.T_parent_joint,
                  toRosTime(robot_.now())));
  static_tf_broadcaster_.sendTransform(transforms);
}

void FakeFetchNode::publishJoints(const ros::Time& stamp) {
  if (is_mute_) return;
  joints_publisher_.publish(jointMessage(kBodyJoints, robot_.joints(), stamp));
  joints_publisher_.publish(jointMessage(kGripperJoints, robot_.joints(), stamp));
}

void FakeFetchNode::publishCommands(const ros::Time& stamp) {
  const JointCommands commands = robot_.takeCommands();
  sensor_msgs::JointState message;
  message.header.stamp = stamp;
  for (const auto& [joint, position] : commands.positions) {
    const auto step = commands.largest_steps.find(joint);
    message.name.push_back(joint);
    message.position.push_back(position);
    message.velocity.push_back(
        step != commands.largest_steps.end() ? step->second / kStepPeriod_s : 0);
  }
  commands_publisher_.publish(message);
}

void FakeFetchNode::publishOdometry(const ros::Time& stamp) {
  const DiffDrive& base = robot_.base();
  nav_msgs::Odometry message;
  message.header.stamp = stamp;
  message.header.frame_id = names_.frame("odom");
  message.child_frame_id = names_.frame(robot_.model().rootLink());
  message.pose.pose = poseMessage(base.odometry());
  message.twist.twist.linear.x = base.linear();
  message.twist.twist.angular.z = base.angular();
  odometry_publisher_.publish(message);
}

void FakeFetchNode::publishTruth(const ros::Time& stamp) {
  geometry_msgs::PoseStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = "map";
  message.pose = poseMessage(robot_.base().truePose());
  truth_publisher_.publish(message);
}

}  // namespace afterglow::nodes

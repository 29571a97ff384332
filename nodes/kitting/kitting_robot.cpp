#include "nodes/kitting/kitting_robot.hpp"

#include <control_msgs/FollowJointTrajectoryActionGoal.h>
#include <control_msgs/GripperCommandActionGoal.h>
#include <control_msgs/PointHeadActionGoal.h>
#include <fmt/format.h>
#include <geometry_msgs/Twist.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>
#include <sound_play/SoundRequest.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <cmath>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/fetch/fetch_facts.hpp"
#include "nodes/kitting/kitting_messages.hpp"

namespace afterglow::nodes {
namespace {

using control_msgs::FollowJointTrajectoryActionGoal;

constexpr double kRaised = -0.7;  // rad of the shoulder: the upper arm points up
constexpr double kLate = 5;       // seconds that a motion may take longer than asked

control_msgs::FollowJointTrajectoryGoal trajectory(const std::vector<std::string>& joints,
                                                   const std::vector<JointPositions>& points,
                                                   double seconds) {
  control_msgs::FollowJointTrajectoryGoal goal;
  goal.trajectory.joint_names = joints;
  for (std::size_t i = 0; i < points.size(); ++i) {
    trajectory_msgs::JointTrajectoryPoint point;
    for (const std::string& joint : joints) point.positions.push_back(points[i].at(joint));
    const double share = static_cast<double>(i + 1) / static_cast<double>(points.size());
    point.time_from_start = ros::Duration(seconds * share);
    goal.trajectory.points.push_back(point);
  }
  return goal;
}

ActionClient followerOf(const std::string& who, const std::string& controller) {
  return ActionClient::of<FollowJointTrajectoryActionGoal>(
      who, "/" + controller + "/follow_joint_trajectory");
}

double distance(const JointPositions& a, const JointPositions& b) {
  double sum = 0;
  for (const auto& [joint, position] : a) sum += std::abs(position - b.at(joint));
  return sum;
}

}  // namespace

KittingRobot::KittingRobot(const RobotModel& model, const calib::Lens& projector)
    : model_(model),
      projector_(projector),
      joint_states_(node_.subscribe("/joint_states", 20, &KittingRobot::onJointState, this)),
      arm_(followerOf("the arm", "arm_with_torso_controller")),
      torso_(followerOf("the torso", "torso_controller")),
      head_(followerOf("the head", "head_controller")),
      turret_(followerOf("the projector's turret", "projector")),
      point_head_(ActionClient::of<control_msgs::PointHeadActionGoal>(
          "the head that looks at points", "/head_controller/point_head")),
      gripper_(ActionClient::of<control_msgs::GripperCommandActionGoal>(
          "the gripper", "/gripper_controller/gripper_action")) {
  out_.wheels = node_.advertise<geometry_msgs::Twist>("/cmd_vel", 10);
  out_.white = node_.advertise<sensor_msgs::PointCloud2>("/projector/white_points", 10);
  out_.green = node_.advertise<sensor_msgs::PointCloud2>("/projector/green_points", 10);
  out_.section = node_.advertise<visualization_msgs::Marker>("/gearbox_compartment_marker", 10);
  out_.path = node_.advertise<visualization_msgs::MarkerArray>("/projector/nav/path", 10);
  out_.scan = node_.advertise<sensor_msgs::LaserScan>("/base_scan_obstacles_only", 10);
  out_.speech = node_.advertise<sound_play::SoundRequest>("/robotsound", 10);
}

void KittingRobot::onJointState(const sensor_msgs::JointState& state) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (std::size_t i = 0; i < std::min(state.name.size(), state.position.size()); ++i) {
    joints_[state.name[i]] = state.position[i];
  }
}

std::string KittingRobot::missing() const {
  if (joints().empty()) return "/joint_states";
  if (!tf_.canTransform("map", "projector_optical_frame", ros::Time(0))) {
    return "the transform from map to projector_optical_frame";
  }
  for (const ActionClient* client : clients_) {
    if (!client->isServed()) return "the action server of " + client->who();
  }
  for (const ros::Publisher* publisher : publishers_) {
    if (publisher->getNumSubscribers() == 0) return "listener on " + publisher->getTopic();
  }
  return "";
}

void KittingRobot::waitUntilReady(double seconds) {
  if (!waitUntil([this] { return missing().empty(); }, seconds)) {
    throw TaskError("the robot is not ready; missing: " + missing());
  }
}

void KittingRobot::leaveGraph() {
  for (ActionClient* client : clients_) client->leave();
  for (ros::Publisher* publisher : publishers_) publisher->shutdown();
}

JointPositions KittingRobot::joints() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return joints_;
}

Eigen::Isometry3d KittingRobot::T_map_link(const std::string& link) const {
  try {
    return toIsometry(tf_.lookupTransform("map", link, ros::Time(0)).transform);
  } catch (const tf2::TransformException& error) {
    throw TaskError("where is " + link + "? " + error.what());
  }
}

Eigen::Isometry3d KittingRobot::gripperDown(const Eigen::Vector3d& p_map, double yaw) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = p_map;
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d closing(std::cos(yaw), std::sin(yaw), 0);
  T.linear() << down, closing, down.cross(closing);
  return T;
}

// A parallel gripper is the same after half a turn about its fingers: take the nearer one.
JointPositions KittingRobot::reach(const Eigen::Isometry3d& T_map_gripper,
                                   const JointPositions& seed) const {
  const Eigen::Isometry3d T_base_map = T_map_base().inverse();
  std::optional<JointPositions> best;
  for (const double half_turn : {0.0, M_PI}) {
    const Eigen::AngleAxisd flip(half_turn, Eigen::Vector3d::UnitX());
    const std::optional<JointPositions> found =
        model_.solveIk(kGripperLink, T_base_map * T_map_gripper * flip, seed, {"torso_lift_joint"});
    if (found && (!best || distance(*found, seed) < distance(*best, seed))) best = found;
  }
  if (!best) {
    const Eigen::Vector3d p = (T_base_map * T_map_gripper).translation();
    throw TaskError(fmt::format("the arm cannot reach ({:.3f}, {:.3f}, {:.3f}) of base_link", p.x(),
                                p.y(), p.z()));
  }
  return *best;
}

void KittingRobot::startArm(const std::vector<Eigen::Isometry3d>& T_map_gripper, double torso,
                            double seconds) {
  JointPositions seed = joints();
  seed["torso_lift_joint"] = torso;
  std::vector<JointPositions> points;
  for (const Eigen::Isometry3d& T : T_map_gripper) {
    points.push_back(reach(T, seed));
    for (const auto& [joint, position] : points.back()) seed[joint] = position;
  }
  sendArm(points, seconds);
}

void KittingRobot::unfoldArm(const Eigen::Isometry3d& T_map_gripper, double torso, double seconds) {
  JointPositions raised = joints();
  raised["torso_lift_joint"] = torso;
  const JointPositions goal = reach(T_map_gripper, raised);
  raised["shoulder_lift_joint"] = kRaised;
  sendArm({raised, goal}, seconds);
}

void KittingRobot::sendArm(const std::vector<JointPositions>& points, double seconds) {
  arm_.send<FollowJointTrajectoryActionGoal>(trajectory(kArmWithTorsoJoints, points, seconds));
  arm_seconds_ = seconds;
}

void KittingRobot::finishArm() { arm_.expectSuccess(arm_seconds_ + kLate); }

void KittingRobot::moveTorso(double height, double seconds) {
  torso_.send<FollowJointTrajectoryActionGoal>(
      trajectory({"torso_lift_joint"}, {{{"torso_lift_joint", height}}}, seconds));
  torso_.expectSuccess(seconds + kLate);
}

void KittingRobot::startHead(double pan, double tilt, double seconds) {
  head_.send<FollowJointTrajectoryActionGoal>(
      trajectory(kHeadJoints, {{{kHeadJoints[0], pan}, {kHeadJoints[1], tilt}}}, seconds));
}

void KittingRobot::finishHead(double seconds) { head_.expectSuccess(seconds + kLate); }

void KittingRobot::setGripper(double gap, double timeout) {
  control_msgs::GripperCommandGoal goal;
  goal.command.position = gap;
  gripper_.send<control_msgs::GripperCommandActionGoal>(goal);
  gripper_.expectSuccess(timeout);
}

void KittingRobot::aimProjector(const Eigen::Vector3d& p_base, double seconds, double widest) {
  const double bearing = std::clamp(std::atan2(p_base.y(), p_base.x()), -widest, widest);
  const double reach = p_base.head<2>().norm();
  const Eigen::Vector3d p(reach * std::cos(bearing), reach * std::sin(bearing), p_base.z());
  const Eigen::Vector2d middle((projector_.width - 1) / 2.0, (projector_.height - 1) / 2.0);
  const auto direction = calib::unproject(projector_, middle);
  const auto aimed =
      direction ? model_.aim(kProjectorTurret, *direction, p, joints()) : std::nullopt;
  if (!aimed) throw TaskError("the projector cannot be aimed there");
  turret_.send<FollowJointTrajectoryActionGoal>(
      trajectory(kProjectorJoints, {*aimed}, seconds));
}

void KittingRobot::attend(const Eigen::Vector3d& p_base, double seconds) {
  control_msgs::PointHeadGoal goal;
  goal.target.header.frame_id = "base_link";
  goal.target.point = toPointMessage(p_base);
  goal.min_duration = ros::Duration(seconds);
  point_head_.send<control_msgs::PointHeadActionGoal>(goal);
  aimProjector(p_base, seconds);
  turret_.expectSuccess(seconds + kLate);
  point_head_.expectSuccess(seconds + kLate);
}

}  // namespace afterglow::nodes

#include "nodes/kitting/kitting_robot.hpp"

#include <algorithm>
#include <cmath>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/fetch/fetch_facts.hpp"

namespace afterglow::nodes {
namespace {

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

template <typename Client>
void expectSuccess(Client& client, const std::string& who, double timeout) {
  if (!client.waitForResult(ros::Duration(timeout))) {
    throw TaskError(who + " did not finish within " + std::to_string(timeout) + " s");
  }
  if (client.getState() != actionlib::SimpleClientGoalState::SUCCEEDED) {
    throw TaskError(who + " gave up: " + client.getState().toString() + " " +
                    client.getState().getText());
  }
}

double distance(const JointPositions& a, const JointPositions& b) {
  double sum = 0;
  for (const auto& [joint, position] : a) sum += std::abs(position - b.at(joint));
  return sum;
}

}  // namespace

void sleepFor(double seconds) {
  if (seconds > 0) ros::Duration(seconds).sleep();
  if (!ros::ok()) throw TaskError("interrupted");
}

KittingRobot::KittingRobot(const RobotModel& model, const calib::Lens& projector)
    : model_(model),
      projector_(projector),
      tf_listener_(tf_),
      arm_("/arm_with_torso_controller/follow_joint_trajectory", false),
      torso_("/torso_controller/follow_joint_trajectory", false),
      head_("/head_controller/follow_joint_trajectory", false),
      turret_("/projector/follow_joint_trajectory", false),
      point_head_("/head_controller/point_head", false),
      gripper_("/gripper_controller/gripper_action", false) {
  joint_states_ = node_.subscribe("/joint_states", 20, &KittingRobot::onJointState, this);
  wheels_ = node_.advertise<geometry_msgs::Twist>("/cmd_vel", 10);
  white_ = node_.advertise<sensor_msgs::PointCloud2>("/projector/white_points", 10);
  green_ = node_.advertise<sensor_msgs::PointCloud2>("/projector/green_points", 10);
  section_ = node_.advertise<visualization_msgs::Marker>("/gearbox_compartment_marker", 10);
  path_ = node_.advertise<visualization_msgs::MarkerArray>("/projector/nav/path", 10);
  scan_ = node_.advertise<sensor_msgs::LaserScan>("/base_scan_obstacles_only", 10);
  speech_ = node_.advertise<sound_play::SoundRequest>("/robotsound", 10);
}

void KittingRobot::onJointState(const sensor_msgs::JointState& state) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (std::size_t i = 0; i < std::min(state.name.size(), state.position.size()); ++i) {
    joints_[state.name[i]] = state.position[i];
  }
}

void KittingRobot::waitUntilReady(double seconds) {
  const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(seconds);
  const auto missing = [&]() -> std::string {
    if (joints().empty()) return "/joint_states";
    if (!tf_.canTransform("map", "projector_optical_frame", ros::Time(0))) {
      return "the transform from map to projector_optical_frame";
    }
    if (!arm_.isServerConnected()) return "the arm's action server";
    if (!torso_.isServerConnected()) return "the torso's action server";
    if (!head_.isServerConnected()) return "the head's trajectory action server";
    if (!turret_.isServerConnected()) return "the projector turret's action server";
    if (!point_head_.isServerConnected()) return "the head's point action server";
    if (!gripper_.isServerConnected()) return "the gripper's action server";
    for (const ros::Publisher* publisher :
         {&wheels_, &white_, &green_, &section_, &path_, &scan_, &speech_}) {
      if (publisher->getNumSubscribers() == 0) return "listener on " + publisher->getTopic();
    }
    return "";
  };
  while (!missing().empty()) {
    if (ros::WallTime::now() > deadline) {
      throw TaskError("the robot is not ready; missing: " + missing());
    }
    sleepFor(0.02);
  }
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

PlanarPose KittingRobot::floorPose() const { return toPlanarPose(T_map_base()); }

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
    throw TaskError("the arm cannot reach (" + std::to_string(p.x()) + ", " +
                    std::to_string(p.y()) + ", " + std::to_string(p.z()) + ") of base_link");
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
  arm_.sendGoal(trajectory(kArmWithTorsoJoints, points, seconds));
  arm_seconds_ = seconds;
}

void KittingRobot::finishArm() { expectSuccess(arm_, "the arm", arm_seconds_ + kLate); }

void KittingRobot::moveTorso(double height, double seconds) {
  torso_.sendGoal(trajectory({"torso_lift_joint"}, {{{"torso_lift_joint", height}}}, seconds));
  expectSuccess(torso_, "the torso", seconds + kLate);
}

void KittingRobot::startHead(double pan, double tilt, double seconds) {
  head_.sendGoal(
      trajectory(kHeadJoints, {{{kHeadJoints[0], pan}, {kHeadJoints[1], tilt}}}, seconds));
}

void KittingRobot::lookAt(const Eigen::Vector3d& p_base, double seconds) {
  control_msgs::PointHeadGoal goal;
  goal.target.header.frame_id = "base_link";
  goal.target.point.x = p_base.x(), goal.target.point.y = p_base.y();
  goal.target.point.z = p_base.z();
  goal.min_duration = ros::Duration(seconds);
  point_head_.sendGoal(goal);
}

void KittingRobot::finishHead(double seconds) { expectSuccess(head_, "the head", seconds + kLate); }

void KittingRobot::setGripper(double gap, double timeout) {
  control_msgs::GripperCommandGoal goal;
  goal.command.position = gap;
  gripper_.sendGoal(goal);
  expectSuccess(gripper_, "the gripper", timeout);
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
  turret_.sendGoal(trajectory(kProjectorJoints, {*aimed}, seconds));
}

void KittingRobot::waitForHeadAndProjector(double seconds) {
  expectSuccess(turret_, "the projector's turret", seconds + kLate);
  expectSuccess(point_head_, "the head", seconds + kLate);
}

void KittingRobot::drive(const PlanarVelocity& command) { wheels_.publish(twist(command)); }

void KittingRobot::projectClusters(const sensor_msgs::PointCloud2& white,
                                   const sensor_msgs::PointCloud2& green) {
  white_.publish(white);
  green_.publish(green);
}

void KittingRobot::projectSection(const visualization_msgs::Marker& marker) {
  section_.publish(marker);
}

void KittingRobot::projectPath(const visualization_msgs::MarkerArray& path) { path_.publish(path); }

void KittingRobot::projectScan(const sensor_msgs::LaserScan& scan) { scan_.publish(scan); }

void KittingRobot::say(const std::string& text, const std::string& voice) {
  speech_.publish(sayRequest(text, voice));
}

}  // namespace afterglow::nodes

#include "nodes/kitting/kitting_task.hpp"

#include <geometry_msgs/Twist.h>

#include <cmath>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/fetch/fetch_facts.hpp"
#include "nodes/kitting/kitting_drive.hpp"
#include "nodes/kitting/kitting_messages.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kSpeechSeconds = 3.6;  // a behavior ends no sooner after its sentence began
constexpr double kSettle = 0.7;         // s that a projection stands before the robot goes on
constexpr double kTail = 0.2;           // s that a behavior goes on after its light is cleared
constexpr double kLook = 1.0;           // s that turning head and projector takes
constexpr double kGripperPatience = 6;  // s
constexpr int kStraightSteps = 4;       // poses of a straight way

// Where the gripper, pointing down, waits between two motions: base_link.
const Eigen::Vector3d kCarry(0.42, 0.32, 1.02);
constexpr double kCarryTorso = 0.10;
constexpr double kUnfold = 3.5, kRetreat = 2.2;  // s, from tucked and from the table to there

// The first two are shown in white, the third in green: the robot takes it for another of them.
const std::vector<std::string> kRecognized = {"gearbox_bottom_left", "gearbox_bottom_right"};
const std::string kGrasped = "wood_chip", kCaddy = "caddy";
constexpr double kPointSpacing = 0.003;
constexpr double kGraspHeight = 0.036;  // of gripper_link over the table: fingers are 31 mm longer
constexpr double kAboveGrasp = 0.13, kLift = 0.16;
constexpr double kOpen = 0.10, kHeld = 0.052;  // gaps between the fingers

// The section it takes for the right one: its center in the caddy's frame, and its cube of light.
const Eigen::Vector3d kSection(0.0725, -0.1125, 0), kCube(0.135, 0.155, 0.10);
constexpr double kPlaceTorso = 0.24;
constexpr double kAboveSection = 0.22, kRelease = 0.095;  // of gripper_link over the table
constexpr double kSectionFloor = 0.008;                   // over the table

Eigen::Isometry3d above(Eigen::Isometry3d T, double height) {
  T.translation().z() += height;
  return T;
}

/// Gripper across the thing: its fingers close along the thing's y.
Eigen::Isometry3d gripperOver(const Eigen::Isometry3d& T_map_thing, double height) {
  return KittingRobot::gripperDown(above(T_map_thing, height).translation(),
                                   toPlanarPose(T_map_thing).yaw + M_PI / 2);
}

}  // namespace

const std::vector<std::string>& kittingTopics() {
  static const std::vector<std::string> topics = {
      "/gripper_controller/gripper_action/goal",
      "/arm_with_torso_controller/follow_joint_trajectory/goal",
      "/torso_controller/follow_joint_trajectory/goal",
      "/head_controller/point_head/goal",
      "/head_controller/follow_joint_trajectory/goal",
      "/cmd_vel",
      "/projector/follow_joint_trajectory/goal",
      "/projector/white_points",
      "/projector/green_points",
      "/gearbox_compartment_marker",
      "/projector/nav/path",
      "/base_scan_obstacles_only",
      "/robotsound",
  };
  return topics;
}

KittingTask::KittingTask(KittingRobot& robot, KittingRoom& room, Callbacks callbacks)
    : robot_(robot), room_(room), callbacks_(std::move(callbacks)) {}

void KittingTask::run(const std::string& behavior) {
  if (behavior == "pick") return pick();
  if (behavior == "drive") return drive();
  if (behavior == "place") return place();
  throw TaskError("the story tells of '" + behavior + "', which the robot cannot do");
}

// --------------------------------------------------------------------------------------- helpers

Eigen::Vector3d KittingTask::inBase(const Eigen::Vector3d& p_map) const {
  return robot_.T_map_base().inverse() * p_map;
}

sensor_msgs::PointCloud2 KittingTask::perceive(const std::vector<std::string>& names) const {
  const Eigen::Vector3d p_eye = robot_.T_map_link("head_camera_link").translation();
  std::vector<Eigen::Vector3d> points;
  for (const std::string& name : names) {
    for (const Eigen::Vector3d& p : room_.visiblePoints(name, p_eye, kPointSpacing)) {
      points.push_back(inBase(p));
    }
  }
  return pointCloud(points);
}

Eigen::Isometry3d KittingTask::carryPose() const {
  const Eigen::Isometry3d T_map_base = robot_.T_map_base();
  return KittingRobot::gripperDown(T_map_base * kCarry, toPlanarPose(T_map_base).yaw + M_PI / 2);
}

void KittingTask::moveArm(const Eigen::Isometry3d& T_map_gripper, double torso, double seconds) {
  robot_.startArm({T_map_gripper}, torso, seconds);
  robot_.finishArm();
}

void KittingTask::moveStraight(const Eigen::Isometry3d& T_map_from,
                               const Eigen::Isometry3d& T_map_to, double torso, double seconds) {
  std::vector<Eigen::Isometry3d> way;
  for (int i = 1; i <= kStraightSteps; ++i) {
    const double share = static_cast<double>(i) / kStraightSteps;
    way.push_back(T_map_to);
    way.back().translation() =
        (1 - share) * T_map_from.translation() + share * T_map_to.translation();
  }
  robot_.startArm(way, torso, seconds);
  robot_.finishArm();
}

void KittingTask::say() {
  said_ = ros::Time::now();
  callbacks_.say();
}

void KittingTask::waitUntilSaid() const {
  sleepFor((said_ + ros::Duration(kSpeechSeconds) - ros::Time::now()).toSec());
}

void KittingTask::prepare() {
  robot_.out().wheels.publish(geometry_msgs::Twist());
  robot_.startHead(0, 0, 1);
  robot_.unfoldArm(carryPose(), kCarryTorso, kUnfold);
  robot_.aimProjector({2, 0, 0}, 1);
  robot_.setGripper(kOpen, kGripperPatience);
  robot_.finishArm();
}

// ------------------------------------------------------------------------------------------ pick

void KittingTask::pick() {
  const Eigen::Isometry3d T_map_object = room_.thing(kGrasped).T_map_thing;
  Eigen::Vector3d p_middle = T_map_object.translation();
  for (const std::string& name : kRecognized) {
    p_middle += room_.thing(name).T_map_thing.translation();
  }
  p_middle /= static_cast<double>(kRecognized.size() + 1);
  robot_.attend(inBase(p_middle), kLook);
  robot_.out().white.publish(perceive(kRecognized));
  robot_.out().green.publish(perceive({kGrasped}));
  sleepFor(kSettle);
  callbacks_.on_moment("perceive");

  grasp(gripperOver(T_map_object, kGraspHeight));
  moveArm(carryPose(), kCarryTorso, kRetreat);
  waitUntilSaid();
  robot_.out().white.publish(pointCloud({}));
  robot_.out().green.publish(pointCloud({}));
  sleepFor(kTail);
}

void KittingTask::grasp(const Eigen::Isometry3d& T_map_grasp) {
  const Eigen::Isometry3d T_map_above = above(T_map_grasp, kAboveGrasp);
  robot_.startArm({T_map_above}, kCarryTorso, 2.2);
  robot_.setGripper(kOpen, kGripperPatience);
  robot_.finishArm();
  callbacks_.on_moment("reach above");
  moveStraight(T_map_above, T_map_grasp, kCarryTorso, 1.0);
  robot_.setGripper(kHeld, kGripperPatience);
  room_.carry(kGrasped, kGripperLink,
              robot_.T_map_link(kGripperLink).inverse() * room_.thing(kGrasped).T_map_thing);
  callbacks_.on_room_changed();
  moveStraight(T_map_grasp, above(T_map_grasp, kLift), kCarryTorso, 1.0);
  callbacks_.on_moment("pick");
  say();
}

// ----------------------------------------------------------------------------------------- drive

void KittingTask::drive() {
  KittingDrive drive(robot_, room_, {callbacks_.on_moment, [this] { say(); }});
  drive.run();
  waitUntilSaid();
  sleepFor(kSettle);
  drive.clearLight();
  robot_.finishHead(1);  // a behavior ends at rest
  sleepFor(kTail);
}

// ----------------------------------------------------------------------------------------- place

void KittingTask::place() {
  robot_.moveTorso(kPlaceTorso, 1.4);
  const Eigen::Isometry3d T_map_section =
      room_.thing(kCaddy).T_map_thing * Eigen::Translation3d(kSection);
  robot_.attend(inBase(T_map_section.translation()), kLook);
  visualization_msgs::Marker cube =
      sectionMarker(robot_.T_map_base().inverse() * above(T_map_section, kCube.z() / 2), kCube);
  robot_.out().section.publish(cube);
  sleepFor(kSettle);
  callbacks_.on_moment("perceive");
  release(T_map_section);
  moveArm(carryPose(), kCarryTorso, kRetreat);
  waitUntilSaid();
  cube.action = visualization_msgs::Marker::DELETE;
  robot_.out().section.publish(cube);
  sleepFor(kTail);
}

void KittingTask::release(const Eigen::Isometry3d& T_map_section) {
  const Eigen::Isometry3d T_map_release = gripperOver(T_map_section, kRelease),
                          T_map_above = gripperOver(T_map_section, kAboveSection);
  moveArm(T_map_above, kPlaceTorso, 2.4);
  callbacks_.on_moment("reach above");
  moveStraight(T_map_above, T_map_release, kPlaceTorso, 1.2);
  say();
  robot_.setGripper(kOpen, kGripperPatience);
  // It falls flat onto the section's floor.
  Eigen::Isometry3d T_map_dropped = above(T_map_section, kSectionFloor);
  T_map_dropped.translation().head<2>() = robot_.T_map_link(kGripperLink).translation().head<2>();
  room_.putDown(kGrasped, T_map_dropped);
  callbacks_.on_room_changed();
  moveStraight(T_map_release, T_map_above, kPlaceTorso, 1.0);
  // Now the hand hides no light.
  callbacks_.on_moment("release");
}

}  // namespace afterglow::nodes

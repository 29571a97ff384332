#include "nodes/kitting/kitting_task.hpp"

#include <cmath>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/fetch/fetch_facts.hpp"
#include "nodes/kitting/kitting_drive.hpp"

namespace afterglow::nodes {
namespace {

constexpr int kStraightSteps = 4;       // poses of a straight way
constexpr double kUnfoldSeconds = 3.5;  // from tucked to ready

Eigen::Isometry3d above(Eigen::Isometry3d T, double height) {
  T.translation().z() += height;
  return T;
}

}  // namespace

KittingTask::KittingTask(const KittingPlan& plan, KittingRobot& robot, KittingRoom& room,
                         OnMoment on_moment)
    : plan_(plan), robot_(robot), room_(room), on_moment_(std::move(on_moment)) {}

// --------------------------------------------------------------------------------------- helpers

Eigen::Vector3d KittingTask::inBase(const Eigen::Vector3d& p_map) const {
  return robot_.T_map_base().inverse() * p_map;
}

void KittingTask::attend(const Eigen::Vector3d& p_map, double seconds) {
  robot_.lookAt(inBase(p_map), seconds);
  robot_.aimProjector(inBase(p_map), seconds);
  robot_.waitForHeadAndProjector(seconds);
}

sensor_msgs::PointCloud2 KittingTask::perceive(const std::vector<std::string>& names) const {
  const Eigen::Vector3d p_eye = robot_.T_map_link("head_camera_link").translation();
  std::vector<Eigen::Vector3d> points;
  for (const std::string& name : names) {
    for (const Eigen::Vector3d& p :
         room_.world().visiblePoints(name, p_eye, plan_.pick.point_spacing)) {
      points.push_back(inBase(p));
    }
  }
  return pointCloud("base_link", ros::Time::now(), points);
}

Eigen::Isometry3d KittingTask::carryPose() const {
  return KittingRobot::gripperDown(robot_.T_map_base() * plan_.carry,
                                   robot_.floorPose().yaw + M_PI / 2);
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

void KittingTask::say(const std::string& text) {
  said_ = ros::Time::now();
  robot_.say(text, plan_.voice);
}

void KittingTask::waitUntilSaid() const {
  const ros::Time end = said_ + ros::Duration(plan_.speech_seconds);
  sleepFor((end - ros::Time::now()).toSec());
}

void KittingTask::prepare() {
  robot_.stop();
  robot_.startHead(0, 0, 1);
  robot_.setGripper(plan_.gripper_open, 10);
  robot_.unfoldArm(carryPose(), plan_.carry_torso, kUnfoldSeconds);
  robot_.aimProjector({2, 0, 0}, 1);
  robot_.finishArm();
}

// ------------------------------------------------------------------------------------------ pick

void KittingTask::pick() {
  const PickPlan& plan = plan_.pick;
  const Thing& object = room_.world().thing(plan.grasped);
  Eigen::Vector3d p_middle = object.T_map_thing.translation();
  for (const std::string& name : plan.recognized) {
    p_middle += room_.world().thing(name).T_map_thing.translation();
  }
  attend(p_middle / static_cast<double>(plan.recognized.size() + 1), plan.seconds.at("look"));
  robot_.projectClusters(perceive(plan.recognized), perceive({plan.grasped}));
  sleepFor(plan_.settle);
  on_moment_("perceive");

  const Eigen::Vector3d p_grasp =
      object.T_map_thing.translation() + Eigen::Vector3d(0, 0, plan.grasp_height);
  grasp(KittingRobot::gripperDown(p_grasp, toPlanarPose(object.T_map_thing).yaw + plan.grasp_yaw));
  moveArm(carryPose(), plan_.carry_torso, plan.seconds.at("retreat"));
  waitUntilSaid();
  const ros::Time now = ros::Time::now();
  robot_.projectClusters(pointCloud("base_link", now, {}), pointCloud("base_link", now, {}));
  sleepFor(plan_.settle);
}

void KittingTask::grasp(const Eigen::Isometry3d& T_map_grasp) {
  const PickPlan& plan = plan_.pick;
  const Eigen::Isometry3d T_map_above = above(T_map_grasp, plan.approach);
  robot_.startArm({T_map_above}, plan.torso, plan.seconds.at("reach"));
  robot_.setGripper(plan_.gripper_open, plan.seconds.at("reach"));
  robot_.finishArm();
  on_moment_("reach above");
  moveStraight(T_map_above, T_map_grasp, plan.torso, plan.seconds.at("descend"));
  robot_.setGripper(plan.gap, plan.seconds.at("close") + 5);
  const Eigen::Isometry3d T_gripper_map = robot_.T_map_link(kGripperLink).inverse();
  room_.carry(plan.grasped, kGripperLink,
              T_gripper_map * room_.world().thing(plan.grasped).T_map_thing);
  moveStraight(T_map_grasp, above(T_map_grasp, plan.lift), plan.torso, plan.seconds.at("lift"));
  on_moment_("pick");
  say(plan.says);
}

// ----------------------------------------------------------------------------------------- drive

void KittingTask::drive() {
  KittingDrive drive(plan_.drive, robot_, room_.world(),
                     {on_moment_, [this] { say(plan_.drive.says); }});
  drive.run();
  waitUntilSaid();
  sleepFor(plan_.settle);
  drive.clearLight();
  robot_.finishHead(1);  // a behavior ends at rest
  sleepFor(plan_.settle);
}

// ----------------------------------------------------------------------------------------- place

void KittingTask::place() {
  const PlacePlan& plan = plan_.place;
  robot_.moveTorso(plan.torso, plan.seconds.at("lift_torso"));
  const Eigen::Isometry3d& T_map_caddy = room_.world().thing(plan.caddy).T_map_thing;
  Eigen::Isometry3d T_caddy_section = Eigen::Isometry3d::Identity();
  T_caddy_section.translation() << plan.section, 0;
  const Eigen::Isometry3d T_map_section = T_map_caddy * T_caddy_section;
  attend(T_map_section.translation(), plan.seconds.at("look"));
  robot_.projectSection(sectionMarker(
      "base_link", robot_.T_map_base().inverse() * above(T_map_section, plan.cube.z() / 2),
      plan.cube));
  sleepFor(plan_.settle);
  on_moment_("perceive");
  release(T_map_section);
  moveArm(carryPose(), plan_.carry_torso, plan.seconds.at("retreat"));
  waitUntilSaid();
  robot_.projectSection(removedSectionMarker("base_link"));
  sleepFor(plan_.settle);
}

void KittingTask::release(const Eigen::Isometry3d& T_map_section) {
  const PlacePlan& plan = plan_.place;
  const double yaw = toPlanarPose(T_map_section).yaw + plan.grasp_yaw;
  const Eigen::Vector3d p = T_map_section.translation();
  const Eigen::Isometry3d T_map_release =
      KittingRobot::gripperDown(p + Eigen::Vector3d(0, 0, plan.release), yaw);
  const Eigen::Isometry3d T_map_above =
      KittingRobot::gripperDown(p + Eigen::Vector3d(0, 0, plan.approach), yaw);
  moveArm(T_map_above, plan.torso, plan.seconds.at("reach"));
  on_moment_("reach above");
  moveStraight(T_map_above, T_map_release, plan.torso, plan.seconds.at("lower"));
  say(plan.says);
  robot_.setGripper(plan_.gripper_open, plan.seconds.at("open") + 5);
  // It falls flat onto the section's floor.
  Eigen::Isometry3d T_map_dropped = above(T_map_section, plan.floor);
  T_map_dropped.translation().head<2>() = robot_.T_map_link(kGripperLink).translation().head<2>();
  room_.putDown(plan_.pick.grasped, T_map_dropped);
  on_moment_("release");
  moveStraight(T_map_release, T_map_above, plan.torso, plan.seconds.at("raise"));
}

}  // namespace afterglow::nodes

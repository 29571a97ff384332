#include "nodes/kitting/kitting_room.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace afterglow::nodes::kitting_room_test {
namespace {

Thing box(const std::string& name, const Eigen::Vector3f& size, const Eigen::Vector3d& at) {
  Thing thing;
  thing.name = name;
  thing.T_map_thing.translation() = at;
  thing.parts = {{{}, render::Cube{size}, {}}};
  return thing;
}

TEST(KittingRoom, eyeSeesOnlyTheSidesThatFaceIt) {
  const KittingRoom room({box("cube", {0.1f, 0.1f, 0.1f}, {1, 0, 0})});
  const auto points = room.visiblePoints("cube", {0, 0, 0}, 0.01);
  EXPECT_GT(points.size(), 80u);
  EXPECT_LT(points.size(), 125u);
  for (const Eigen::Vector3d& p : points) EXPECT_NEAR(p.x(), 0.95, 1e-6);
}

TEST(KittingRoom, eyeDoesNotSeeThroughThings) {
  const KittingRoom room(
      {box("cube", {0.1f, 0.1f, 0.1f}, {1, 0, 0}), box("screen", {0.01f, 1, 1}, {0.5, 0.5, 0})});
  const auto points = room.visiblePoints("cube", {0, 0, 0}, 0.01);
  ASSERT_FALSE(points.empty());
  for (const Eigen::Vector3d& p : points) EXPECT_LE(p.y(), 1e-9);
}

TEST(KittingRoom, laserRangesAreTheDistancesToTheObstacle) {
  Thing obstacle = box("obstacle", {0.2f, 0.2f, 1}, {2, 0, 0});
  obstacle.is_low = true;
  const KittingRoom room({obstacle, box("table", {1, 1, 1}, {1.5, -2, 0})});
  Eigen::Isometry3d T_map_laser = Eigen::Isometry3d::Identity();
  T_map_laser.translation() << 0.2, 0, 0.3;
  T_map_laser.rotate(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));  // as a Fetch's hangs
  ros::Time::init();
  const auto scan = room.scan(T_map_laser);
  EXPECT_NEAR(scan.angle_max,
              scan.angle_min + scan.angle_increment * static_cast<float>(scan.ranges.size() - 1),
              1e-5);
  const auto points = scanPoints(scan, T_map_laser);
  ASSERT_GT(points.size(), 10u);
  for (const Eigen::Vector3d& p : points) {
    EXPECT_NEAR(p.x(), 1.9, 1e-6);  // the side that faces the laser
    EXPECT_NEAR(p.z(), 0.3, 1e-6);
    EXPECT_NEAR(p.y(), 0, 0.1001);
  }
}

TEST(KittingRoom, removingTheObjectsLeavesTheFurnitureAndGhostsThatNobodyMeets) {
  Thing table = box("table", {1, 1, 1}, {0, 0, 0});
  table.is_furniture = true;
  Thing object = box("object", {1, 1, 1}, {2, 0, 0});
  object.is_low = true;
  KittingRoom room({table, object});
  ASSERT_EQ(room.obstacles().poses.size(), 2u);
  room.removeObjects();
  const auto markers = room.markers().markers;
  ASSERT_EQ(markers.size(), 3u) << "one clears";
  EXPECT_EQ(markers[1].color.a, 1);
  EXPECT_EQ(markers[2].ns, "object");
  EXPECT_GT(markers[2].color.a, 0);
  EXPECT_LT(markers[2].color.a, 0.9);
  EXPECT_EQ(room.obstacles().poses.size(), 1u);
  EXPECT_TRUE(room.visiblePoints("object", {2, 5, 0}, 0.01).empty());
}

TEST(KittingRoom, ghostsShowTheirLargePartsAlone) {
  Thing object = box("object", {0.1f, 0.1f, 0.1f}, {2, 0, 0});
  object.parts.push_back({{}, render::Cube{Eigen::Vector3f(0.01f, 0.02f, 0.01f)}, {}});
  KittingRoom room({object});
  EXPECT_EQ(room.markers().markers.size(), 3u);
  room.removeObjects();
  EXPECT_EQ(room.markers().markers.size(), 2u);
}

TEST(KittingRoom, showsWhatIsCarriedWithItsCarrier) {
  KittingRoom room({box("thing", {1, 1, 1}, {0, 0, 1})});
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 5, 0, 0;
  room.carry("thing", "gripper_link", T);
  const auto carried = room.markers().markers.at(1);
  EXPECT_EQ(carried.type, visualization_msgs::Marker::CUBE);
  EXPECT_EQ(carried.header.frame_id, "gripper_link");
  EXPECT_EQ(carried.pose.position.x, 5);
  EXPECT_EQ(carried.ns, "thing");
  room.putDown("thing", T);
  const auto put_down = room.markers().markers.at(1);
  EXPECT_EQ(put_down.header.frame_id, "map");
  EXPECT_EQ(put_down.pose.position.x, 5);
}

TEST(KittingRoom, refusesNamesUsedTwiceAndNamesUnknown) {
  const Thing thing = box("a", {1, 1, 1}, {0, 0, 0});
  EXPECT_THROW(KittingRoom({thing, thing}), std::invalid_argument);
  EXPECT_THROW(KittingRoom({}).thing("a"), std::invalid_argument);
}

TEST(KittingRoom, demoRoomShowsWhatTheTaskNames) {
  ros::Time::init();
  const KittingRoom room(loadThings("assets/demo/room.urdf"));
  for (const char* name : {"gearbox_bottom_left", "gearbox_bottom_right", "wood_chip"}) {
    EXPECT_GT(room.visiblePoints(name, {0.25, 0, 1.2}, 0.004).size(), 200u) << name;
  }
  EXPECT_NO_THROW(room.thing("caddy"));
  EXPECT_EQ(room.surfaces().size(), 2u);
}

}  // namespace
}  // namespace afterglow::nodes::kitting_room_test

#include "nodes/kitting/kitting_world.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "nodes/kitting/kitting_plan.hpp"

namespace afterglow::nodes::kitting_world_test {
namespace {

Thing box(const std::string& name, const Eigen::Vector3d& size, const Eigen::Vector3d& at) {
  Thing thing;
  thing.name = name;
  thing.T_map_thing.translation() = at;
  Part part;
  part.size = size;
  thing.parts = {part};
  return thing;
}

double area(const std::vector<Triangle>& triangles) {
  double sum = 0;
  for (const Triangle& t : triangles) sum += (t[1] - t[0]).cross(t[2] - t[0]).norm() / 2;
  return sum;
}

// Divergence theorem: right only if every triangle looks outward.
double volume(const std::vector<Triangle>& triangles) {
  double sum = 0;
  for (const Triangle& t : triangles) sum += t[0].dot(t[1].cross(t[2])) / 6;
  return sum;
}

TEST(KittingWorld, surfacesAreClosedAndLookOutward) {
  Part part;
  part.size = {0.2, 0.3, 0.4};
  EXPECT_NEAR(area(partTriangles(part)), 2 * (0.06 + 0.08 + 0.12), 1e-12);
  EXPECT_NEAR(volume(partTriangles(part)), 0.024, 1e-12);
  part.shape = Part::Shape::Cylinder;
  part.size = {0.2, 0.2, 0.5};
  EXPECT_NEAR(volume(partTriangles(part)), M_PI * 0.01 * 0.5, 0.02 * M_PI * 0.01 * 0.5);
  part.shape = Part::Shape::Prism;
  part.outline = {{0, 0}, {1, 0}, {1, 1}};
  EXPECT_NEAR(volume(partTriangles(part)), 0.25, 1e-12);
}

TEST(KittingWorld, rayFindsTheNearestThing) {
  const World world({box("far", {1, 1, 1}, {5, 0, 0}), box("near", {1, 1, 1}, {3, 0, 0})});
  const auto distance = world.castRay({0, 0.1, 0.2}, Eigen::Vector3d::UnitX());
  ASSERT_TRUE(distance);
  EXPECT_NEAR(*distance, 2.5, 1e-12);
  EXPECT_FALSE(world.castRay({0, 0.1, 0.2}, -Eigen::Vector3d::UnitX()));
  EXPECT_FALSE(world.castRay({0, 0.6, 0.2}, Eigen::Vector3d::UnitX()));
}

TEST(KittingWorld, eyeSeesOnlyTheSidesThatFaceIt) {
  const World world({box("cube", {0.1, 0.1, 0.1}, {1, 0, 0})});
  const auto points = world.visiblePoints("cube", {0, 0, 0}, 0.01);
  EXPECT_GT(points.size(), 80u);
  EXPECT_LT(points.size(), 122u);
  for (const Eigen::Vector3d& p : points) EXPECT_NEAR(p.x(), 0.95, 1e-9);
}

TEST(KittingWorld, eyeDoesNotSeeThroughThings) {
  const World world(
      {box("cube", {0.1, 0.1, 0.1}, {1, 0, 0}), box("screen", {0.01, 1, 1}, {0.5, 0.5, 0})});
  const auto points = world.visiblePoints("cube", {0, 0, 0}, 0.01);
  ASSERT_FALSE(points.empty());
  for (const Eigen::Vector3d& p : points) EXPECT_LE(p.y(), 1e-9);
}

TEST(KittingWorld, laserRangesAreTheDistancesToTheObstacle) {
  Thing obstacle = box("obstacle", {0.2, 0.2, 1}, {2, 0, 0});
  obstacle.low = true;
  const World world({obstacle, box("table", {1, 1, 1}, {1.5, -2, 0})});
  Eigen::Isometry3d T_map_laser = Eigen::Isometry3d::Identity();
  T_map_laser.translation() << 0.2, 0, 0.3;
  T_map_laser.rotate(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));  // as a Fetch's hangs
  const ScanGeometry geometry;
  const auto ranges = scanObstacles(world, T_map_laser, geometry);
  const auto points = scanPoints(ranges, T_map_laser, geometry);
  ASSERT_GT(points.size(), 10u);
  for (const Eigen::Vector3d& p : points) {
    EXPECT_NEAR(p.x(), 1.9, 1e-6);  // the side that faces the laser
    EXPECT_NEAR(p.z(), 0.3, 1e-6);
    EXPECT_NEAR(p.y(), 0, 0.1001);
  }
}

TEST(KittingWorld, removingTheObjectsLeavesTheFurniture) {
  Thing table = box("table", {1, 1, 1}, {0, 0, 0});
  table.furniture = true;
  World world({table, box("object", {1, 1, 1}, {0, 0, 1})});
  world.removeObjects();
  EXPECT_EQ(world.things().size(), 1u);
  EXPECT_FALSE(world.castRay({-5, 0, 1}, Eigen::Vector3d::UnitX()));
  EXPECT_TRUE(world.castRay({-5, 0, 0}, Eigen::Vector3d::UnitX()));
}

TEST(KittingWorld, refusesNamesUsedTwiceAndNamesUnknown) {
  const Thing thing = box("a", {1, 1, 1}, {0, 0, 0});
  EXPECT_THROW(World({thing, thing}), std::invalid_argument);
  EXPECT_THROW(World({}).thing("a"), std::invalid_argument);
}

TEST(KittingWorld, demoRoomShowsWhatTheTaskNames) {
  const World room = loadRoom("assets/demo/room.yaml");
  const KittingPlan plan = loadKittingPlan("assets/demo/task.yaml");
  const Eigen::Vector3d p_eye(0.25, 0, 1.2);
  for (const std::string& name : plan.pick.recognized) {
    EXPECT_GT(room.visiblePoints(name, p_eye, plan.pick.point_spacing).size(), 200u) << name;
  }
  EXPECT_GT(room.visiblePoints(plan.pick.grasped, p_eye, plan.pick.point_spacing).size(), 200u);
  EXPECT_NO_THROW(room.thing(plan.place.caddy));
}

}  // namespace
}  // namespace afterglow::nodes::kitting_world_test

#include "nodes/kitting/kitting_path.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace afterglow::nodes::kitting_path_test {
namespace {

using Eigen::Vector2d;

TEST(KittingPath, isStraightWhereNothingIsInTheWay) {
  const FloorPath path = planDetour({0, 0}, {0, 2}, {{3, 1}}, 0.5);
  for (const Vector2d& p : path) EXPECT_NEAR(p.x(), 0, 1e-12);
  EXPECT_EQ(path.front(), Vector2d(0, 0));
  EXPECT_EQ(path.back(), Vector2d(0, 2));
}

TEST(KittingPath, keepsClearOfTheObstacleOnTheShorterSide) {
  const std::vector<Vector2d> obstacle = {{0.1, 1.0}, {0.2, 1.1}};
  const FloorPath path = planDetour({0, 0}, {0, 2}, obstacle, 0.5);
  double leftmost = 0;
  for (const Vector2d& p : path) {
    leftmost = std::min(leftmost, p.x());
    for (const Vector2d& o : obstacle) EXPECT_GE((p - o).norm(), 0.5);
  }
  EXPECT_LT(leftmost, -0.35);
  EXPECT_GT(leftmost, -0.5);
}

TEST(KittingPath, refusesAnEndThatIsNotFree) {
  EXPECT_THROW(planDetour({0, 0}, {0, 2}, {{0, 1.9}}, 0.5), std::invalid_argument);
}

TEST(KittingPath, measuresAlongThePath) {
  const FloorPath path = {{0, 0}, {1, 0}, {1, 2}};
  EXPECT_TRUE(pointAlong(path, 1.5).isApprox(Vector2d(1, 0.5)));
  EXPECT_TRUE(pointAlong(path, 9).isApprox(Vector2d(1, 2)));
  EXPECT_NEAR(nearestAlong(path, {1.2, 0.5}), 1.5, 1e-12);
  EXPECT_NEAR(nearestAlong(path, {-3, 0}), 0, 1e-12);
}

TEST(KittingPath, turnsTheShortWay) {
  EXPECT_NEAR(turnBetween(3, -3), 2 * M_PI - 6, 1e-12);
  EXPECT_NEAR(turnBetween(0, M_PI), M_PI, 1e-12);
}

// A base that obeys at once.
PlanarPose moved(PlanarPose pose, const PlanarVelocity& command, double period) {
  pose.yaw += command.turn * period / 2;
  pose.x += command.forward * period * std::cos(pose.yaw);
  pose.y += command.forward * period * std::sin(pose.yaw);
  pose.yaw += command.turn * period / 2;
  return pose;
}

TEST(PathFollower, arrivesWhereAndAsWanted) {
  const DriveLimits limits;
  PathFollower follower(planDetour({0, 0}, {0, 2.8}, {{0.1, 1.4}}, 0.5), 0, limits);
  PlanarPose pose;
  PlanarVelocity before;
  const double period = 0.04;
  int steps = 0;
  while (follower.phase() != PathFollower::Phase::Done && steps < 1000) {
    const PlanarVelocity command = follower.step(pose, period);
    EXPECT_LE(command.forward, limits.speed + 1e-9);
    EXPECT_LE(command.forward - before.forward, limits.acceleration * period + 1e-9);
    EXPECT_LE(std::abs(command.turn), limits.turn_speed + 1e-9);
    EXPECT_GE((positionOf(pose) - Vector2d(0.1, 1.4)).norm(), 0.42);
    pose = moved(pose, command, period);
    before = command;
    ++steps;
  }
  EXPECT_LT(steps * period, 14);
  EXPECT_LT((positionOf(pose) - Vector2d(0, 2.8)).norm(), 0.03);
  EXPECT_NEAR(pose.yaw, 0, 0.02);
  EXPECT_EQ(follower.step(pose, period).forward, 0);
}

TEST(PathFollower, needsAPath) {
  EXPECT_THROW(PathFollower({{0, 0}}, 0, {}), std::invalid_argument);
}

}  // namespace
}  // namespace afterglow::nodes::kitting_path_test

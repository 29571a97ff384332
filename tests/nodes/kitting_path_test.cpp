#include "nodes/kitting/kitting_drive.hpp"

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

TEST(KittingPath, isDrivenFromRestToRestInTurnPathAndTurn) {
  const FloorPath path = planDetour({0, 0}, {0, 2.8}, {{0.1, 1.4}}, 0.5);
  const replay::Stamp begin{1'000'000'000};
  const TimedDrive drive = timedDrive(path, {0, 0, 0}, 0, begin);
  EXPECT_EQ(drive.track.begin().ns, begin.ns);
  const PlanarPose turned = drive.track.at(drive.turned);
  EXPECT_NEAR(turned.yaw, M_PI / 2, 0.05);
  EXPECT_NEAR(positionOf(turned).norm(), 0, 1e-9);
  EXPECT_LT((positionOf(drive.track.endPose()) - Vector2d(0, 2.8)).norm(), 1e-9);
  EXPECT_NEAR(drive.track.endPose().yaw, 0, 1e-9);
  double fastest = 0;
  for (replay::Stamp at = begin; at < drive.track.end(); at.ns += 50'000'000) {
    fastest = std::max(fastest, drive.track.velocityAt(at).forward);
    EXPECT_GE((positionOf(drive.track.at(at)) - Vector2d(0.1, 1.4)).norm(), 0.5 - 1e-3);
  }
  EXPECT_NEAR(fastest, 0.6, 0.08);
  EXPECT_LT(drive.track.velocityAt({drive.turned.ns + 100'000'000}).forward, 0.3);
  EXPECT_LT(replay::secondsBetween(begin, drive.track.end()), 12);
}

}  // namespace
}  // namespace afterglow::nodes::kitting_path_test

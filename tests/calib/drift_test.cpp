
#include <gtest/gtest.h>

#include "calib/verify/tag_layout.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::calib::drift_test {
namespace {

const std::vector<Tag> kFloor = {
    squareTag(1, {-0.3, 0.8}, 0.16, 0), squareTag(2, {0.3, 0.8}, 0.16, 0.5),
    squareTag(3, {-0.3, 1.3}, 0.16, 0), squareTag(4, {0.3, 1.3}, 0.16, 0),
    squareTag(5, {8, 1}, 0.16, 0)};  // the last is out of sight

Lens camera() { return test::lens(1280, 960, 900, 640, 480, {-0.1, 0.05, 0, 0, 0}); }

Rigid<Camera, Surface> cameraOver(const Eigen::Vector3d& eye) {
  const auto T_world_camera = test::lookAt<Camera>(eye, eye + Eigen::Vector3d(0, 1, -1.2));
  return Rigid<Camera, Surface>(T_world_camera.inverse().matrix());
}

std::vector<Tag> seenFrom(const Rigid<Camera, Surface>& T_camera_floor) {
  std::vector<Tag> seen;
  for (const Tag& tag : kFloor) {
    if (tag.id == 5) continue;
    Tag in_picture = tag;
    for (Eigen::Vector2d& corner : in_picture.corners) {
      corner = *project(camera(), T_camera_floor * Eigen::Vector3d(corner.x(), corner.y(), 0));
    }
    seen.push_back(in_picture);
  }
  return seen;
}

TEST(Drift, isNoneWhereEverythingIsWhereItShouldBe) {
  const auto T = cameraOver({0, 0, 1.3});
  const Drift drift = driftOf(kFloor, seenFrom(T), T, camera());
  EXPECT_EQ(drift.expected, 4);
  ASSERT_EQ(drift.seen.size(), 4u);
  // The lens bends a tag's diagonals by a trifle.
  EXPECT_LT(drift.median_px, 0.1);
  EXPECT_LT(drift.median_mm, 0.2);
}

TEST(Drift, isTheDistanceThatTheRobotIsOff) {
  const auto T = cameraOver({0, 0, 1.3});
  // The robot stands 20 mm to the right of where tf has it: all seems moved to the left.
  const Drift drift = driftOf(kFloor, seenFrom(cameraOver({0.02, 0, 1.3})), T, camera());
  EXPECT_NEAR(drift.median_mm, 20, 0.2);
  EXPECT_GT(drift.median_px, 8);
  EXPECT_LT(drift.median_px, 16);
}

TEST(Drift, countsTheNearerOfTwoAndForgetsStrangers) {
  const auto T = cameraOver({0, 0, 1.3});
  std::vector<Tag> seen = seenFrom(T);
  seen.resize(2);
  Tag poster = seen[0];  // the same tag on a poster
  for (Eigen::Vector2d& corner : poster.corners) corner.x() += 200;
  seen.insert(seen.begin(), poster);
  Tag stranger = poster;
  stranger.id = 77;
  seen.push_back(stranger);
  const Drift drift = driftOf(kFloor, seen, T, camera());
  ASSERT_EQ(drift.seen.size(), 2u);
  EXPECT_LT(drift.seen[0].px, 0.1);
  EXPECT_EQ(drift.seen[0].id, 1);
}

TEST(Drift, isUnknownWhenNothingIsSeen) {
  const Drift drift = driftOf(kFloor, {}, cameraOver({0, 0, 1.3}), camera());
  EXPECT_EQ(drift.expected, 4);
  EXPECT_TRUE(drift.seen.empty());
  const auto away = cameraOver({0, 50, 1.3});
  EXPECT_EQ(driftOf(kFloor, {}, away, camera()).expected, 0);
}

}  // namespace
}  // namespace afterglow::calib::drift_test

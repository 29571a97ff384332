// What of the robot a laser may see, and what the simulated one sees.
#include "nodes/player/base_sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "nodes/fetch/fake_laser.hpp"

namespace afterglow::nodes::live_scan_test {
namespace {

TEST(LiveScan, knowsTheRobotsLinksByItsDescription) {
  const std::string urdf =
      "<robot name='r'><link name=\"base_link\"/><link\n name='arm_link'><visual/></link>"
      "<joint name=\"elbow\" type='fixed'><parent link=\"base_link\"/><child link='arm_link'/>"
      "</joint></robot>";
  EXPECT_EQ(linkNames(urdf), (std::set<std::string>{"arm_link", "base_link"}));
  EXPECT_TRUE(linkNames("").empty());
  EXPECT_TRUE(linkNames("<robot " + std::string(100000, 'a')).empty());
}

TEST(FakeLaser, seesWallsAndThingsTheOtherWayRoundWhenItHangsUpsideDown) {
  FakeLaser laser({}, FakeLaser::kFetchView, 0);
  laser.setThings({{1, 1, 0.2}});  // ahead to the left
  const auto at = [&](double angle) {
    return static_cast<std::size_t>((angle - laser.firstAngle()) / laser.angleStep() + 0.5);
  };
  const std::vector<float> upright = laser.look({}, false), hanging = laser.look({}, true);
  ASSERT_EQ(upright.size(), FakeLaser::kBeams);
  EXPECT_NEAR(upright[at(0)], 6, 1e-3);
  EXPECT_NEAR(upright[at(M_PI / 4)], std::sqrt(2.) - 0.2, 1e-2);
  EXPECT_NEAR(hanging[at(-M_PI / 4)], std::sqrt(2.) - 0.2, 1e-2);
  EXPECT_GT(upright[at(-M_PI / 4)], 8);
}

}  // namespace
}  // namespace afterglow::nodes::live_scan_test

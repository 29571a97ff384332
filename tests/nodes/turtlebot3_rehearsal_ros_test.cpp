// A TurtleBot3 is recorded and replayed by its profile: without multiplexer, without ramps, and it
// goes on with its last velocity for half a second.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/support/robots/rehearsal.hpp"

namespace afterglow::nodes::turtlebot3_rehearsal_ros_test {
namespace {

using namespace test;
using replay::PlanarPose;

constexpr double kFastest = 0.22;  // m/s

struct Turtlebot3Rehearsal : testing::Test {
  static void SetUpTestSuite() {
    robot = new Rehearsal("turtlebot3", "turtlebot3", {"_localization_noise/position:=0.01"});
  }
  static void TearDownTestSuite() { delete robot; }
  Turtlebot3Rehearsal() { robot->putBack(); }

  /// Ahead, to the left in an arc, ahead; where it ends.
  static std::int64_t recordDrive(PlanarPose& end) {
    const std::int64_t behavior = Rehearsal::record({"/cmd_vel"}, [] {
      robot->drive("/cmd_vel", {{{0.2, 0}, 1.5}, {{0.15, 0.6}, 1.5}, {{0.2, 0}, 1}});
    });
    end = robot->witness->pose();
    robot->putBack();
    return behavior;
  }
  static bool isUnderWay() { return robot->witness->pose().x > 0.25; }
  static void expectArrived(const PlanarPose& end) {
    const PlanarPose is = robot->witness->pose();
    EXPECT_LT(distance(is, end), 0.03);
    EXPECT_LT(std::abs(replay::wrapAngle(is.yaw - end.yaw)), 0.06);
  }

  static inline Rehearsal* robot = nullptr;
};

TEST_F(Turtlebot3Rehearsal, arrivesNoFasterThanItCanAndPausesAtOnce) {
  PlanarPose end;
  const std::int64_t behavior = recordDrive(end);
  EXPECT_GT(distance(end, {}), 0.5);
  EXPECT_EQ(robot->replay(behavior), "");
  EXPECT_NE(robot->report().find("\"closed_loop\":true"), std::string::npos) << robot->report();
  expectArrived(end);
  EXPECT_LT(robot->witness->fastestBase(), 1.1 * kFastest);

  robot->putBack();
  robot->beginReplay(behavior);
  ASSERT_TRUE(eventually(isUnderWay)) << robot->player().log();
  EXPECT_LT(robot->pause(), 0.4) << "before it would have stopped by itself";
  Rehearsal::resume();
  EXPECT_EQ(robot->endOfReplay(), "");
  expectArrived(end);
}

TEST_F(Turtlebot3Rehearsal, standsWithinItsPatienceWhenThePlayerIsKilled) {
  PlanarPose end;
  const std::int64_t behavior = recordDrive(end);
  robot->beginReplay(behavior);
  ASSERT_TRUE(eventually(isUnderWay)) << robot->player().log();
  const ros::WallTime since = ros::WallTime::now();
  robot->player().signal(SIGKILL);
  ASSERT_TRUE(eventually([] { return robot->witness->stands(); }));
  EXPECT_LT((robot->witness->lastMoved() - since).toSec(), 0.4) << "its watchdog sends zeros";
}

}  // namespace
}  // namespace afterglow::nodes::turtlebot3_rehearsal_ros_test

// A base that goes sideways, too, with the manners of a PR2's: it stands at once where it hears
// nothing for 0.2 s.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "replay/motion/base/base_tracker.hpp"
#include "replay/motion/base/floor.hpp"
#include "tests/support/simulated_replay.hpp"

namespace afterglow::replay::holonomic_base_test {
namespace {

using namespace test;

constexpr DriveFaults kPr2{1, 1, 0, 0.08, 0, kPr2Manners};
constexpr DriveFaults kImperfectPr2{1.02, 0.98, 0.03, 0.08, 0, kPr2Manners};

TrackerOptions holonomic() {
  TrackerOptions options;
  options.is_holonomic = true;
  return options;
}

/// By `length` m in a direction, seen from the base, while it turns by `angle` in all.
void slide(Commands& commands, double length, double direction, double angle = 0) {
  double gone = 0;
  while (length - gone > 1e-3) {
    const double speed =
        std::min(profile(gone, length, 0.5, 0.5), (length - gone) / kCommandPeriod);
    const double turned = angle * gone / length;  // it goes straight in the room
    commands.push_back({speed * std::cos(direction - turned), angle * speed / length,
                        speed * std::sin(direction - turned)});
    gone += speed * kCommandPeriod;
  }
}

/// To the left, back to the right while it turns, slantwise, and ahead.
Commands dance() {
  Commands commands;
  stand(commands, 0.5);
  slide(commands, 1, kPi / 2);
  stand(commands, 0.3);
  slide(commands, 1.5, -kPi / 2, 90 * kDegree);
  slide(commands, 0.8, 0.7);
  drive(commands, 0.6, 0);
  stand(commands, 0.5);
  return commands;
}

RecordedDrive exactDance() { return record(dance(), kPr2, kExact, 1); }

TEST(HolonomicVelocity, takesABaseAlongAnArcThatItNeedNotLookAlong) {
  const PlanarPose left = advance({1, 2, kPi / 2}, {0, 0, 0.5}, 2);
  EXPECT_NEAR(left.x, 0, 1e-12);
  EXPECT_NEAR(left.y, 2, 1e-12);
  EXPECT_NEAR(left.yaw, kPi / 2, 1e-12);
  PlanarPose inSteps;
  for (int i = 0; i < 100'000; ++i) inSteps = advance(inSteps, {0.3, 0.8, -0.4}, 1e-5);
  const PlanarPose atOnce = advance({}, {0.3, 0.8, -0.4}, 1);
  EXPECT_NEAR(distance(atOnce, inSteps), 0, 1e-5);
  EXPECT_NEAR(atOnce.yaw, 0.8, 1e-9);
}

TEST(HolonomicBase, followsItsTrackInEveryDirectionAndWhileItTurns) {
  const RecordedDrive recorded = exactDance();
  Replay replay(recorded, holonomic(), {}, kPr2);
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(replay.largest, 0.03);
  EXPECT_LT(replay.endError(), 0.01);
  EXPECT_LT(replay.endTurn(), 0.5 * kDegree);
  EXPECT_EQ(replay.tracker.progress(), recorded.track.end());
}

TEST(HolonomicBase, getsThereThoughItSlipsAndIsSeenInexactly) {
  const RecordedDrive recorded = record(dance(), kPr2, k1Cm, 2);
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    Replay replay(recorded, holonomic(), {0.03, -0.04, 3 * kDegree}, kImperfectPr2, k1Cm, seed);
    replay.run();
    EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
    EXPECT_LT(replay.largest, 0.09) << seed;
    EXPECT_LT(replay.endError(), 0.025) << seed;
    EXPECT_LT(replay.endTurn(), 1.5 * kDegree) << seed;
  }
}

TEST(HolonomicBase, comesBackToItsTrackSidewaysWithoutTurning) {
  Commands commands;
  drive(commands, 2, 0);
  const RecordedDrive recorded = record(commands, kPr2, kExact, 1);
  Replay replay(recorded, holonomic(), {0, 0.08, 0}, kPr2);
  double turned = 0, aside = 0;
  replay.disturb = [&](double, BaseInput&) {
    turned = std::max(turned, std::abs(replay.command.turn));
    aside = std::min(aside, replay.command.left);
  };
  replay.run();
  EXPECT_LT(turned, 0.01) << "yaw is followed independently";
  EXPECT_LT(aside, -0.05);
  EXPECT_LT(std::abs(between(recorded.end, replay.robot.truth()).y), 0.01);
}

TEST(HolonomicBase, keepsItsLimitsInEveryDirectionTogether) {
  const RecordedDrive recorded = exactDance();
  TrackerOptions options = holonomic();
  options.speed = 0.25;
  options.turn_speed = 0.4;
  options.acceleration = 0.3;
  Replay replay(recorded, options, {}, kPr2);
  PlanarVelocity last;
  replay.disturb = [&](double, BaseInput&) {
    const PlanarVelocity& now = replay.command;
    EXPECT_LE(now.speed(), 0.25 + 1e-9);
    EXPECT_LE(std::abs(now.turn), 0.4 + 1e-9);
    if (!now.isZero()) {  // it may stand at once
      EXPECT_LE(std::hypot(now.forward - last.forward, now.left - last.left), 0.3 * 0.03 + 1e-9);
    }
    last = now;
  };
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(replay.largest, 0.12) << "behind, where it may not get faster";
}

TEST(HolonomicBase, standsWhereItHearsNothingAndGoesOnFromThere) {
  const RecordedDrive recorded = exactDance();
  Replay replay(recorded, holonomic(), {}, kPr2);
  while (replay.tracker.state() == BaseState::Following && replay.command.left < 0.4) replay.step();
  ASSERT_GT(replay.robot.velocity().left, 0.3);
  double now = replay.now();
  for (int i = 0; i < 100; ++i, now += kStep) replay.robot.step(now);  // the player hangs
  EXPECT_TRUE(replay.robot.velocity().isZero());
  replay.steps += 100;
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(replay.endError(), 0.01);
}

TEST(HolonomicBase, isNeededForATrackThatGoesSideways) {
  const RecordedDrive recorded = exactDance();
  Replay replay(recorded, {}, {}, {});  // a differential drive
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Lost);
  EXPECT_NE(replay.tracker.reason().find("off its track"), std::string::npos)
      << replay.tracker.reason();
}

TEST(HolonomicBase, stopsBeforeWhatStandsBesideIt) {
  Commands commands;
  slide(commands, 2, kPi / 2);
  const RecordedDrive recorded = record(commands, kPr2, kExact, 1);
  const SweptPath path = pathAlong(recorded.track, recorded.track.begin(),
                                   recorded.track.startPose(), 0.3, 3, true);
  const Footprint round = Footprint::circle(0.3);
  EXPECT_NEAR(freeWay(path, round, 0.05, {{0, 1}}).way, 0.65, 0.05);
  EXPECT_TRUE(std::isinf(freeWay(path, round, 0.05, {{1, 0}}).way)) << "what is ahead of it";
}

}  // namespace
}  // namespace afterglow::replay::holonomic_base_test

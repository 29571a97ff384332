#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>

#include "replay/motion/base/base_tracker.hpp"
#include "tests/support/simulated_replay.hpp"

namespace afterglow::replay::base_tracker_test {
namespace {

using namespace test;

RecordedDrive exactDrive(const Commands& commands) { return record(commands, {}, kExact, 1); }

// ------------------------------------------------------------------------------------- the drive

TEST(BaseTracker, drivesBackwardAndTurnsInPlaceAsRecorded) {
  Commands commands;
  turn(commands, -120 * kDegree);
  drive(commands, -1.2, 0.2);
  stand(commands, 1);
  drive(commands, 0.6, -0.1);
  turn(commands, 170 * kDegree);
  const RecordedDrive recorded = exactDrive(commands);
  Replay replay(recorded, {}, {0.01, -0.01, 0.01}, {1.01, 0.99, 0.02, 0.08});
  double backward = 0, forward = 0;
  replay.disturb = [&](double, BaseInput&) {
    if (replay.tracker.state() != BaseState::Following) return;
    backward = std::min(backward, replay.command.forward);
    forward = std::max(forward, replay.command.forward);
  };
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(backward, -0.4);
  EXPECT_GT(forward, 0.3);
  EXPECT_LT(replay.largest, 0.03);
  EXPECT_LT(replay.endError(), 0.01);
  EXPECT_LT(replay.endTurn(), 0.5 * kDegree);
  EXPECT_EQ(replay.tracker.progress(), recorded.track.end());
}

TEST(BaseTracker, comesBackToATrackThatItStartedBeside) {
  for (const double length : {2.5, -2.5}) {
    Commands commands;
    drive(commands, length, 0);
    const RecordedDrive recorded = exactDrive(commands);
    Replay replay(recorded, {}, {0, 0.08, 0});
    while (replay.tracker.state() == BaseState::Following) replay.step();
    EXPECT_LT(std::abs(between(recorded.start, replay.robot.truth()).y), 0.015) << length;
    EXPECT_LT(std::abs(between(recorded.start, replay.robot.truth()).yaw), 3 * kDegree) << length;
  }
}

TEST(BaseTracker, leavesABaseAloneThatStoodWhenItWasRecorded) {
  Commands commands;
  stand(commands, 5);
  const RecordedDrive recorded = exactDrive(commands);
  Replay replay(recorded, {}, {}, {}, k3Cm, 4);
  while (replay.tracker.state() == BaseState::Following) {
    replay.step();
    ASSERT_EQ(replay.command.forward, 0);
    ASSERT_EQ(replay.command.turn, 0);
  }
  EXPECT_NEAR(replay.now(), 5.6, 0.3);
}

TEST(BaseTracker, keepsLimitsAndTheShapeOfThePathByTakingLonger) {
  const RecordedDrive recorded = exactDrive(detour());
  TrackerOptions options;
  options.speed = 0.25;
  options.turn_speed = 0.5;
  options.acceleration = 0.3;
  options.turn_acceleration = 1;
  Replay replay(recorded, options);
  PlanarVelocity last;
  replay.disturb = [&](double, BaseInput&) {
    EXPECT_LE(std::abs(replay.command.forward), 0.25 + 1e-9);
    EXPECT_LE(std::abs(replay.command.turn), 0.5 + 1e-9);
    EXPECT_LE(std::abs(replay.command.forward - last.forward), 0.3 * 0.03 + 1e-9);
    EXPECT_LE(std::abs(replay.command.turn - last.turn), 0.03 + 1e-9);
    last = replay.command;
  };
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(replay.largest, 0.08);
  EXPECT_GT(replay.tracker.report().delay, 5);
}

TEST(BaseTracker, drivesAtHalfAndTwiceTheRate) {
  const RecordedDrive recorded = exactDrive(detour());
  const double length = secondsBetween(recorded.track.begin(), recorded.track.end());
  for (const double rate : {0.5, 1.5}) {
    TrackerOptions options;
    options.rate = rate;
    Replay replay(recorded, options, {}, {1.01, 0.99, 0.02, 0.08});
    while (replay.tracker.state() == BaseState::Following) replay.step();
    EXPECT_NEAR(replay.now(), length / rate, 0.25 * length / rate) << rate;
    replay.run();
    EXPECT_LT(replay.endError(), 0.012) << rate;
  }
}

TEST(BaseTracker, toleratesADelayOtherThanItWasTold) {
  const RecordedDrive recorded = exactDrive(detour());
  for (const double delay : {0.02, 0.16}) {
    Replay replay(recorded, {}, {0.01, 0.01, 0.01}, {1.01, 0.99, 0.02, delay});
    replay.run();
    EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
    EXPECT_LT(replay.largest, 0.08) << delay;
    EXPECT_LT(replay.endError(), 0.012) << delay;
  }
}

TEST(BaseTracker, followsOdometryAloneFromWhereverItStands) {
  const RecordedDrive recorded = exactDrive(detour());
  TrackerOptions options;
  options.with_localization = false;
  Replay replay(recorded, options);
  replay.disturb = [](double, BaseInput& input) { input.T_map_odom.reset(); };
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(replay.endError(), 0.01);  // its wheels are exact
  EXPECT_LT(replay.tracker.report().end_distance, 0.01);
}

// ---------------------------------------------------------------------------------------- faults

TEST(BaseTracker, standsWithoutOdometryAndGoesOnWithIt) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {});
  std::optional<StampedPose> last;
  replay.disturb = [&](double now, BaseInput& input) {
    if (now < 5 || now > 8) {
      last = input.T_odom_base;
    } else {
      input.T_odom_base = last;
    }
  };
  replay.runUntil(5.4);
  const Stamp progress = replay.tracker.progress();
  while (replay.now() < 7.9) {
    replay.step();
    ASSERT_EQ(replay.command.forward, 0);
    ASSERT_EQ(replay.command.turn, 0);
    ASSERT_EQ(replay.tracker.progress(), progress);
    ASSERT_NE(replay.tracker.reason().find("no odometry for"), std::string::npos);
  }
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_EQ(replay.tracker.reason(), "");
  EXPECT_LT(replay.endError(), 0.01);
}

TEST(BaseTracker, givesUpWhenThePoseStaysAway) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {});
  replay.disturb = [](double now, BaseInput& input) {
    if (now > 5) input.T_map_odom->stamp = stampAt(5);
  };
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Lost);
  EXPECT_NE(replay.tracker.reason().find("no localization for"), std::string::npos);
  EXPECT_NEAR(replay.now(), 5 + 2 + 10, 1);
}

TEST(BaseTracker, isLostWhenPushedOffTheTrackAndStandsStill) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {});
  replay.runUntil(6);
  PlanarPose pushed = replay.robot.truth();
  pushed.y += 0.8;
  replay.robot.push(pushed);
  replay.runUntil(8);
  EXPECT_EQ(replay.tracker.state(), BaseState::Lost);
  EXPECT_NE(replay.tracker.reason().find("off its track"), std::string::npos);
  EXPECT_EQ(replay.command.forward, 0);
  for (int i = 0; i < 100; ++i) replay.step();
  EXPECT_EQ(replay.command.forward, 0);
  EXPECT_EQ(replay.robot.velocity().forward, 0);
}

TEST(BaseTracker, isLostBeforeItMovesWhenFarFromTheStart) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {}, {0, 1.2, 0});
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Lost);
  EXPECT_EQ(replay.tracker.reason(), "the base is 1.20 m and 0 deg off its track");
  EXPECT_NEAR(distance(replay.robot.truth(), recorded.start), 1.2, 1e-9);
}

TEST(BaseTracker, waitsForABaseThatIsHeldAndCutsNoCorner) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {});
  replay.runUntil(6);
  replay.robot.is_stuck = true;
  replay.runUntil(11);
  const Stamp held = replay.tracker.progress();
  replay.runUntil(13);
  EXPECT_LT(secondsBetween(held, replay.tracker.progress()), 0.2);
  replay.robot.is_stuck = false;
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(replay.largest, 0.18);
  EXPECT_LT(replay.endError(), 0.01);
}

TEST(BaseTracker, givesUpOnABaseThatDoesNotFollow) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {});
  replay.robot.is_stuck = true;
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Lost);
  EXPECT_NE(replay.tracker.reason().find("the base does not follow"), std::string::npos);
}

TEST(BaseTracker, ignoresAnOutlierOfLocalization) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {});
  replay.disturb = [](double now, BaseInput& input) {
    if (now > 6 && now < 6.09 && input.T_map_odom) input.T_map_odom->pose.x += 2;
  };
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(replay.largest, 0.03);
}

TEST(BaseTracker, goesOnAfterAPauseOfItsCaller) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {});
  replay.runUntil(6);
  const Stamp progress = replay.tracker.progress();
  replay.robot.command(replay.now(), {});
  for (int i = 0; i < 1000; ++i) {  // 10 s
    replay.seen.look(replay.now(), replay.robot);
    replay.robot.step(replay.now());
    ++replay.steps;
  }
  EXPECT_EQ(replay.tracker.progress(), progress);
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(replay.largest, 0.25);  // what it takes to brake
  EXPECT_LT(replay.endError(), 0.01);
}

TEST(BaseTracker, doesNotWaitForALocalizationThatSaysNothingNew) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {}, {}, {}, k3Cm, 5);
  std::optional<StampedPose> last;
  double stood = 0;
  replay.disturb = [&](double, BaseInput& input) {
    if (replay.tracker.state() == BaseState::Following) {
      last = input.T_map_odom;
    } else if (input.T_map_odom) {
      input.T_map_odom->pose = last->pose;  // as AMCL, which looks again only when it has moved
      if (replay.tracker.report().corrections == 0) stood += 0.03;
    }
  };
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_NEAR(stood, 1.5, 0.2);
}

TEST(BaseTracker, reportsEndErrorDriftAndDeviation) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {}, {}, {1.02, 1, 0, 0.08});
  replay.run();
  const BaseReport report = replay.tracker.report();
  EXPECT_NEAR(report.end_distance, replay.endError(), 0.01);
  EXPECT_NEAR(report.end_turn, replay.endTurn(), 0.3 * kDegree);
  EXPECT_NEAR(report.drift_distance, 0.06, 0.02);  // 2 % of 3 m
  EXPECT_LT(report.drift_turn, 0.5 * kDegree);
  EXPECT_GT(report.largest_distance, 0);
  EXPECT_LT(report.delay, 2);
}

TEST(BaseTracker, refusesLimitsThatAreNone) {
  TrackerOptions options;
  options.acceleration = 0;
  EXPECT_THROW(BaseTracker(PoseTrack({{stampAt(0), {}}}, "map", true), options),
               std::invalid_argument);
}

}  // namespace
}  // namespace afterglow::replay::base_tracker_test

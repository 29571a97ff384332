// A recorded drive is driven again by a robot with other wheels, from a start that is a little off,
// seen by a noisy localization. Errors are measured against where the robots truly were.
#include "replay/motion/base_tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <string>

#include "tests/support/simulated_drive.hpp"

namespace afterglow::replay {
namespace {

using namespace test;

constexpr LocalizationFaults kExact{0, 0, 0};

/// A replay, 33 commands a second, by a robot whose odometry has an origin of its own.
struct Replay {
  const RecordedDrive& recorded;
  BaseTracker tracker;
  SimulatedDrive robot;
  SimulatedLocalization seen;
  int steps = 0;
  double largest = 0;  ///< m off the recorded drive, at the progress reached
  PlanarVelocity command;
  /// Called before each command.
  std::function<void(double now, BaseInput&)> disturb = [](double, BaseInput&) {};

  Replay(const RecordedDrive& drive, const TrackerOptions& options,
         const PlanarPose& start_error = {}, const DriveFaults& faults = {},
         const LocalizationFaults& localization = kExact, std::uint32_t seed = 1)
      : recorded(drive),
        tracker(drive.track, options),
        robot(compose(drive.start, start_error), {5, -3, 2}, faults, seed),
        seen(localization, seed + 1) {}

  double now() const { return steps * kStep; }
  bool isOver() const {
    return tracker.state() == BaseState::Done || tracker.state() == BaseState::Lost;
  }

  void step() {
    const auto pose = seen.look(now(), robot);
    if (steps % 3 == 0) {
      BaseInput input{stampAt(now()), StampedPose{stampAt(now()), robot.odometry()}, pose};
      disturb(now(), input);
      command = tracker.update(input);
      robot.command(now(), command);
    }
    robot.step(now());
    ++steps;
    const auto at = static_cast<std::size_t>(
        secondsBetween(recorded.track.begin(), tracker.progress()) / kStep);
    const PlanarPose& should = recorded.truth[std::min(at, recorded.truth.size() - 1)];
    largest = std::max(largest, distance(robot.truth(), should));
  }
  void runUntil(double seconds) {
    while (now() < seconds && !isOver()) step();
  }
  /// To the end, and until it stands.
  void run() {
    runUntil(120);
    for (int i = 0; i < 50; ++i) step();
  }
  double endError() const { return distance(robot.truth(), recorded.end); }
  double endTurn() const { return std::abs(wrapAngle(robot.truth().yaw - recorded.end.yaw)); }
};

RecordedDrive exactDrive(const Commands& commands) { return record(commands, {}, kExact, 1); }

// --------------------------------------------------------------------------- the paper's figure

struct Errors {
  std::vector<double> position, turn, on_the_way, later;
};

double percentile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1) + 0.5)];
}

std::string medianAnd95(const std::vector<double>& values, double unit) {
  char text[40];
  std::snprintf(text, sizeof(text), "%5.2f /%5.2f", percentile(values, 0.5) / unit,
                percentile(values, 0.95) / unit);
  return text;
}

/// 1 % of wheel scale, of turns too; slip.
DriveFaults otherWheels(Bell& bell) {
  DriveFaults faults;
  faults.distance_scale = 1 + bell(0.01);
  faults.turn_scale = 1 + bell(0.01);
  faults.slip = 0.02;
  return faults;
}

/// As rosbag play would do it, with perfect timing.
PlanarPose replayBlindly(const RecordedDrive& recorded, const PlanarPose& start,
                         const DriveFaults& faults, std::uint32_t seed) {
  SimulatedDrive robot(start, {}, faults, seed);
  const auto steps = static_cast<int>(recorded.commands.size()) * 2;
  for (int i = 0; i < steps + 50; ++i) {
    if (i % 2 == 0 && i < steps) {
      robot.command(i * kStep, recorded.commands[static_cast<std::size_t>(i / 2)]);
    }
    robot.step(i * kStep);
  }
  return robot.truth();
}

struct Figure {
  Errors open, closed;
};

/// 50 replays of the detour, of as many recordings.
Figure replayTheDetour(const char* title, const LocalizationFaults& recording,
                       const LocalizationFaults& replaying, double stood) {
  Figure figure;
  TrackerOptions options;
  options.noise.position = replaying.position;
  options.noise.yaw = replaying.yaw;
  for (std::uint32_t run = 0; run < 50; ++run) {
    Bell bell(run * 17 + 3);
    DriveFaults slipping;
    slipping.slip = 0.02;
    const RecordedDrive recorded =
        record(detour(), slipping, recording, run + 500, options.noise, stood);
    const DriveFaults faults = otherWheels(bell);
    const PlanarPose start_error = bell.pose(0.01, 0.5 * kDegree);
    const PlanarPose blind =
        replayBlindly(recorded, compose(recorded.start, start_error), faults, run);
    figure.open.position.push_back(distance(blind, recorded.end));
    figure.open.turn.push_back(std::abs(wrapAngle(blind.yaw - recorded.end.yaw)));
    Replay replay(recorded, options, start_error, faults, replaying, run + 900);
    replay.run();
    EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
    figure.closed.position.push_back(replay.endError());
    figure.closed.turn.push_back(replay.endTurn());
    figure.closed.on_the_way.push_back(replay.largest);
    figure.closed.later.push_back(replay.now() -
                                  static_cast<double>(recorded.truth.size()) * kStep);
  }
  std::printf(
      "%s, median / 95%%: open loop %s cm %s deg; closed loop %s cm %s deg, on the way %s "
      "cm, %s s longer\n",
      title, medianAnd95(figure.open.position, 0.01).c_str(),
      medianAnd95(figure.open.turn, kDegree).c_str(),
      medianAnd95(figure.closed.position, 0.01).c_str(),
      medianAnd95(figure.closed.turn, kDegree).c_str(),
      medianAnd95(figure.closed.on_the_way, 0.01).c_str(),
      medianAnd95(figure.closed.later, 1).c_str());
  return figure;
}

// Successive measurements, 0.1 s apart, share 60 % of their error.
constexpr LocalizationFaults k3Cm{0.03, kDegree, 0.2};
constexpr LocalizationFaults k1Cm{0.01, 0.2 * kDegree, 0.2};

TEST(BaseTracker, endsTheDetourWithin2CmOnA3CmLocalization) {
  const Figure figure = replayTheDetour("3 cm, exact recording", kExact, k3Cm, 0);
  EXPECT_LT(percentile(figure.closed.position, 0.95), 0.02);
  EXPECT_LT(percentile(figure.closed.turn, 0.95), 0.6 * kDegree);
  EXPECT_LT(percentile(figure.closed.on_the_way, 0.95), 0.08);
  EXPECT_GT(percentile(figure.open.position, 0.5), 0.03);
}

TEST(BaseTracker, endsTheDetourWithin1CmOnA1CmLocalization) {
  const Figure figure = replayTheDetour("1 cm, exact recording", kExact, k1Cm, 0);
  EXPECT_LT(percentile(figure.closed.position, 0.95), 0.01);
  EXPECT_LT(percentile(figure.closed.turn, 0.95), 0.6 * kDegree);
}

TEST(BaseTracker, endsTheDetourAsWellWhenItWasRecordedByTheSameLocalization) {
  const Figure coarse =
      replayTheDetour("3 cm, recorded likewise and 10 s of standing", k3Cm, k3Cm, 10);
  EXPECT_LT(percentile(coarse.closed.position, 0.95), 0.02);
  EXPECT_LT(percentile(coarse.closed.turn, 0.95), 0.6 * kDegree);
  const Figure fine =
      replayTheDetour("1 cm, recorded likewise and 10 s of standing", k1Cm, k1Cm, 10);
  EXPECT_LT(percentile(fine.closed.position, 0.95), 0.01);
  EXPECT_LT(percentile(fine.closed.turn, 0.95), 0.6 * kDegree);
}

TEST(BaseTracker, isAlmostAsGoodWithALessKnownEnd) {
  const Figure figure = replayTheDetour("3 cm, recorded likewise, stopped at once", k3Cm, k3Cm, 0);
  EXPECT_LT(percentile(figure.closed.position, 0.95), 0.03);
  EXPECT_LT(percentile(figure.closed.turn, 0.95), 1.2 * kDegree);
}

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

TEST(BaseTracker, reportsEndErrorDriftAndDeviation) {
  const RecordedDrive recorded = exactDrive(detour());
  Replay replay(recorded, {}, {}, {1.02, 1, 0, 0.08});
  replay.run();
  const BaseReport report = replay.tracker.report();
  EXPECT_NEAR(report.end_distance, replay.endError(), 0.01);
  EXPECT_NEAR(report.end_turn, replay.endTurn(), 0.3 * kDegree);
  EXPECT_LT(report.end_uncertainty, 0.01);
  EXPECT_NEAR(report.drift_distance, 0.06, 0.02);  // 2 % of 3 m
  EXPECT_LT(report.drift_turn, 0.5 * kDegree);
  EXPECT_GT(report.largest_distance, 0);
  EXPECT_GT(report.largest_distance_at, recorded.track.begin());
  EXPECT_LT(report.delay, 2);
}

TEST(BaseTracker, refusesLimitsThatAreNone) {
  TrackerOptions options;
  options.acceleration = 0;
  EXPECT_THROW(BaseTracker(PoseTrack({{stampAt(0), {}}}, "map", true), options),
               std::invalid_argument);
}

}  // namespace
}  // namespace afterglow::replay

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

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
    EXPECT_NEAR(replay.tracker.report().delay, replay.now() - length / rate, 0.1) << rate;
    replay.run();
    EXPECT_LT(replay.endError(), 0.012) << rate;
  }
}

TEST(BaseTracker, takesASlowRateForNoStandstill) {
  Commands commands;
  drive(commands, 2, 0);
  const RecordedDrive recorded = exactDrive(commands);
  TrackerOptions options;
  options.rate = 0.2;
  options.patience = 1;
  Replay replay(recorded, options);
  replay.runUntil(8);
  EXPECT_EQ(replay.tracker.state(), BaseState::Following) << replay.tracker.reason();
  EXPECT_TRUE(replay.tracker.isOnTime());
}

// --------------------------------------------------------------------------------------- the law

/// A track of 10 s at a steady velocity, and a base that obeys at once, whatever it is told; it
/// stands, off the track's begin by an error as the track's header has it: ahead, to the left, and
/// turned.
struct Led {
  PoseTrack track;
  BaseTracker tracker;
  BaseInput input;
  PlanarVelocity command;

  static PoseTrack steady(const PlanarVelocity& velocity) {
    std::vector<PoseTrack::Sample> samples;
    for (int i = 0; i <= 500; ++i) {
      samples.push_back({stampAt(0.02 * i), advance({2, 1, 0.3}, velocity, 0.02 * i)});
    }
    return {samples, "map", true};
  }
  static TrackerOptions obedient(bool is_holonomic, double rate) {
    TrackerOptions options;
    options.is_holonomic = is_holonomic;
    options.rate = rate;
    options.speed = options.turn_speed = 1e3;
    options.acceleration = options.turn_acceleration = 1e6;
    options.noise.position = options.noise.yaw = 1;  // at rest it is left alone
    return options;
  }
  Led(const PlanarVelocity& velocity, const PlanarPose& error, TrackerOptions options)
      : track(steady(velocity)), tracker(track, options) {
    const PlanarPose T_base_track{error.x, error.y, error.yaw};
    input.T_map_odom = {stampAt(0), compose(track.startPose(), inverse(T_base_track))};
    step(0);
    step(0.02);
  }
  void step(double now) {
    input.now = stampAt(now);
    input.T_odom_base = {input.now, {}};
    command = tracker.update(input);
  }
  /// Recorded seconds a second, after what it saw.
  double pace() {
    const Stamp before = tracker.progress();
    step(0.04);
    return secondsBetween(before, tracker.progress()) / 0.02;
  }
};

TEST(BaseTracker, isLedByTheLawOfItsHeader) {
  for (const PlanarVelocity& velocity :
       {PlanarVelocity{0.5, 0.3}, {-0.5, 0.4}, {0.4, 0}, {0, 0.8}, {0, -0.3}}) {
    for (const PlanarPose& error :
         {PlanarPose{0, 0, 0}, {0.008, 0.02, -0.05}, {-0.008, -0.03, 0.07}, {0, 0.05, 0.1}}) {
      const TrackerOptions options = Led::obedient(false, 1);
      const Led led(velocity, error, options);
      const double turn = velocity.turn, ahead = velocity.forward;
      const double gain = 2 * options.damping *
                          std::max(0.6, std::sqrt(turn * turn + options.stiffness * ahead * ahead));
      const double sinc = error.yaw == 0 ? 1 : std::sin(error.yaw) / error.yaw;
      EXPECT_NEAR(led.command.forward, ahead * std::cos(error.yaw) + gain * error.x, 1e-3)
          << ahead << " " << turn << " " << error.x;
      EXPECT_NEAR(led.command.turn,
                  turn + options.stiffness * ahead * sinc * error.y + gain * error.yaw, 1e-3)
          << ahead << " " << turn << " " << error.x;
    }
  }
}

TEST(BaseTracker, isLedInXAndYAndYawIndependentlyWhereItIsHolonomic) {
  for (const PlanarVelocity& velocity : {PlanarVelocity{0.3, 0.2, 0.4}, {-0.2, 0, 0.4}}) {
    for (const PlanarPose& error :
         {PlanarPose{0, 0, 0}, {0.006, -0.004, 0.1}, {-0.02, -0.01, -0.08}}) {
      const Led led(velocity, error, Led::obedient(true, 1));
      const double c = std::cos(error.yaw), s = std::sin(error.yaw);
      EXPECT_NEAR(led.command.forward, c * velocity.forward - s * velocity.left + 2 * error.x,
                  2e-3);
      EXPECT_NEAR(led.command.left, s * velocity.forward + c * velocity.left + 2 * error.y, 2e-3);
      EXPECT_NEAR(led.command.turn, velocity.turn + 2 * error.yaw, 1e-3);
    }
  }
}

TEST(BaseTracker, waitsWhereItIsAheadAndDoesNotGoTheOtherWay) {
  EXPECT_EQ(Led({0.5, 0}, {-0.3, 0.02, 0}, Led::obedient(false, 1)).command.forward, 0);
  EXPECT_EQ(Led({-0.5, 0}, {0.3, 0.02, 0}, Led::obedient(false, 1)).command.forward, 0);
  const Led slanting({0.3, 0, 0.4}, {-0.18, -0.24, 0}, Led::obedient(true, 1));
  EXPECT_NEAR(slanting.command.speed(), 0, 1e-9);
  const Led aside({0.5, 0, 0}, {-0.3, 0.03, 0}, Led::obedient(true, 1));
  EXPECT_NEAR(aside.command.forward, 0, 1e-9);
  EXPECT_NEAR(aside.command.left, 0.06, 2e-3) << "but comes back from beside it";
}

TEST(BaseTracker, catchesUpNoFasterThanItsHeaderSays) {
  TrackerOptions eager = Led::obedient(false, 1);
  eager.stiffness = 100;
  EXPECT_NEAR(Led({0.5, 0}, {0.03, 0, 0}, eager).command.forward, 1.05 * 0.5, 1e-3)
      << "5 % more than the fastest of the drive";
  EXPECT_NEAR(Led({0.5, 0}, {0.095, 0, 0}, eager).command.forward, 1.05 * 0.25 + 0.1, 1e-3)
      << "5 % and 0.1 m/s more than the reference, which waits";
}

/// Half-way between where the path time begins to slow down and where it is slowest.
TEST(BaseTracker, hasItsPathTimeWaitForABaseThatLagsOrIsOff) {
  struct Case {
    PlanarVelocity velocity;
    PlanarPose error;
    double pace;
    bool is_holonomic = false;
  };
  for (const Case& it : {Case{{0.5, 0}, {0.03, 0.05, 0.1}, 1},
                         {{0.5, 0}, {0.095, 0, 0}, 0.5},
                         {{0.5, 0}, {-0.2, 0, 0}, 1},
                         {{0.5, 0}, {0, -0.155, 0}, 0.5},
                         {{0.5, 0}, {0, 0.3, 0}, 0.3},
                         {{0.5, 0}, {0, 0, -0.285}, 0.5},
                         {{0.5, 0}, {0.095, 0.155, 0.2025}, 0.25},
                         {{-0.5, 0}, {-0.095, 0, 0}, 0.5},
                         {{-0.5, 0}, {0.2, 0, 0}, 1},
                         {{0, 0.8}, {-0.095, 0, 0}, 0.5},
                         {{0.3, 0, 0.4}, {0.057, 0.076, 0}, 0.5, true},
                         {{0.3, 0, 0.4}, {-0.12, -0.16, 0}, 1, true},
                         {{0.3, 0, 0.4}, {0.124, -0.093, 0}, 0.5, true},
                         {{0.3, 0, 0.4}, {-0.24, 0.18, 0}, 0, true},
                         {{0, 0.5}, {0.057, -0.076, 0}, 0.5, true}}) {
    Led led(it.velocity, it.error, Led::obedient(it.is_holonomic, 1));
    EXPECT_EQ(led.tracker.isOnTime(), it.pace == 1);
    EXPECT_NEAR(led.pace(), it.pace, 0.02)
        << it.velocity.forward << " " << it.error.x << " " << it.error.y << " " << it.error.yaw;
  }
  Led fast({0.5, 0}, {0.095, 0, 0}, Led::obedient(false, 2));
  EXPECT_FALSE(fast.tracker.isOnTime());
  EXPECT_NEAR(fast.pace(), 2 * 0.5, 0.02);
}

TEST(BaseTracker, hasItsReferenceGetFasterAsTheBaseCanAfterAHalt) {
  Commands commands;
  drive(commands, 4, 0);
  const RecordedDrive recorded = exactDrive(commands);
  Replay replay(recorded, {});
  replay.runUntil(4);
  replay.tracker.rest();
  replay.robot.command(replay.now(), {});
  for (int i = 0; i < 100; ++i) {
    replay.seen.look(replay.now(), replay.robot);
    replay.robot.step(replay.now());
    ++replay.steps;
  }
  const Stamp before = replay.tracker.progress();
  replay.runUntil(replay.now() + 0.6);
  // 85 % of 0.7 m/s^2, after a first step of a tenth of a second, on a track of 0.5 m/s.
  const double most = 0.1 + 0.85 * 0.7 * (0.1 + 0.6 / 2) * 0.6 / 0.5;
  EXPECT_LT(secondsBetween(before, replay.tracker.progress()), most);
  EXPECT_GT(secondsBetween(before, replay.tracker.progress()), 0.05);
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
  EXPECT_EQ(replay.tracker.reason().find(" and 0 deg"), std::string::npos)
      << "it should have turned: " << replay.tracker.reason();
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

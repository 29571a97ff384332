// Drives at other rates than they were recorded at, and drives that were told to stand at once, by
// bases that get faster and slower as real ones do.
#include "replay/motion/base/drive_timing.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/support/simulated_replay.hpp"

namespace afterglow::replay::drive_timing_test {
namespace {

using namespace test;

/// Straight on, with ramps.
Commands rampedDrive(double length, double fastest, double ramp) {
  Commands commands;
  stand(commands, 1);
  double gone = 0, speed = 0;
  while (length - gone > 1e-3) {
    const double most = std::min({speed + ramp * kCommandPeriod, fastest,
                                  std::sqrt(2 * ramp * (length - gone)),
                                  (length - gone) / kCommandPeriod});
    speed = std::max(0.02, most);
    commands.push_back({speed, 0});
    gone += speed * kCommandPeriod;
  }
  stand(commands, 2);
  return commands;
}

/// As a keyboard says it: full speed, and nothing.
Commands abruptDrive() {
  Commands commands;
  stand(commands, 1);
  commands.insert(commands.end(), 90, PlanarVelocity{0.8, 0});
  stand(commands, 2);
  return commands;
}

/// A base with ramps of its own, wheels that lag by 50 ms, and a way of the commands to it.
DriveFaults rampingBase(double ramp, double delay = 0.08) {
  DriveFaults faults;
  faults.delay = delay;
  faults.manners.acceleration = ramp;
  faults.manners.turn_acceleration = 2;
  faults.manners.lag = 0.05;
  faults.manners.fastest = 1;
  return faults;
}

TrackerOptions limitsOf(double ramp, double rate) {
  TrackerOptions options;
  options.rate = rate;
  options.acceleration = ramp;
  options.turn_acceleration = 2;
  return options;
}

/// A drive again, by the same base, whose odometry comes 50 times a second.
struct Again {
  test::Replay replay;
  double beyond = 0, backward = 0, peak = 0;  ///< m of its end, m, m/s

  Again(const RecordedDrive& recorded, const DriveFaults& faults, const TrackerOptions& options)
      : replay(recorded, options, {}, faults) {
    StampedPose heard;
    double next = 0;
    replay.disturb = [&](double now, BaseInput& input) {
      if (now >= next - 1e-9) heard = *input.T_odom_base, next = now + 0.02;
      input.T_odom_base = heard;
    };
    PlanarPose last = replay.robot.truth();
    for (int after = 0; after < 50; after += replay.isOver() && ++after) {
      replay.step();
      const PlanarPose& now = replay.robot.truth();
      beyond = std::max(beyond, between(recorded.end, now).x);
      backward += std::max(0., -between(last, now).x);
      peak = std::max(peak, replay.robot.velocity().forward);
      last = now;
    }
  }
};

/// Ten seconds at a velocity.
PoseTrack steady(const PlanarVelocity& velocity) {
  std::vector<PoseTrack::Sample> samples;
  for (int i = 0; i <= 500; ++i) {
    samples.push_back({stampAt(0.02 * i), advance({}, velocity, 0.02 * i)});
  }
  return {samples, "map", true};
}

TEST(DriveTiming, isAsRecordedWhereTheBaseCanDoThat) {
  const RecordedDrive recorded = record(rampedDrive(1.2, 0.45, 0.5), {}, kExact, 1);
  const double length = secondsBetween(recorded.track.begin(), recorded.track.end());
  EXPECT_NEAR(DriveTiming(recorded.track, limitsOf(1, 1), 1).seconds(), length, 0.02);
  EXPECT_NEAR(DriveTiming(recorded.track, limitsOf(1, 1), 0.5).seconds(), 2 * length, 0.04);
}

TEST(DriveTiming, takesLongerWhereTheRateNeedsSteeperRamps) {
  const RecordedDrive recorded = record(rampedDrive(1.2, 0.45, 0.5), {}, kExact, 1);
  const double length = secondsBetween(recorded.track.begin(), recorded.track.end());
  const DriveTiming timing(recorded.track, limitsOf(1, 1), 2);
  EXPECT_GT(timing.seconds(), length / 2 + 0.2);
  EXPECT_LT(timing.seconds(), length / 2 + 1);
  double before = 0, at_s = 0;
  for (Stamp at = recorded.track.begin(); at < recorded.track.end(); at = later(at, 0.05)) {
    const double pace = timing.paceAt(at), speed = pace * recorded.track.velocityAt(at).speed();
    EXPECT_LE(pace, 2);
    EXPECT_LE(std::abs(speed - before), 1.0 * 0.05 / pace + 0.02) << at_s;
    before = speed;
    at_s += 0.05;
  }
}

TEST(DriveTiming, comesToRestAtTheEndOfATrackThatEndsInMotion) {
  std::vector<PoseTrack::Sample> samples;
  for (int i = 0; i <= 40; ++i) samples.push_back({stampAt(0.05 * i), {0.03 * i, 0, 0}});
  const PoseTrack track(samples, "map", true);
  const DriveTiming timing(track, limitsOf(0.5, 1), 1);
  EXPECT_LT(timing.paceAt(track.end()) * 0.6, 0.1) << "m/s";
  EXPECT_GT(timing.paceAt(later(track.begin(), 1)), 0.9);
  EXPECT_NEAR(timing.wayToRest(track.begin()) + 0.015, 1.2, 0.05);
}

TEST(DriveTiming, knowsTheWayToWhereTheBaseTurnsBack) {
  Commands commands;
  drive(commands, 1, 0);
  drive(commands, -0.5, 0);
  const RecordedDrive recorded = record(commands, {}, kExact, 1);
  const DriveTiming timing(recorded.track, limitsOf(0.7, 1), 1);
  EXPECT_NEAR(timing.wayToRest(later(recorded.track.begin(), 1.5)), 1 - 0.5, 0.08);
  EXPECT_NEAR(timing.wayToRest(recorded.track.end()), 0, 1e-9);
}

TEST(DriveTiming, isLimitedByWhatARecordingShows) {
  const RecordedDrive recorded = record(abruptDrive(), rampingBase(0.5), kExact, 1);
  EXPECT_NEAR(shownBy(recorded.track).acceleration, 0.5, 0.06);
  EXPECT_EQ(shownBy(recorded.track).turn_acceleration, 0.5) << "the least that is assumed";
  EXPECT_EQ(shownBy(steady({0.4, 0.8})).turn_acceleration, 0.5) << "it turned all the time";
  Commands turning;
  turn(turning, 170 * kDegree);
  const PoseTrack turned = record(turning, rampingBase(0.5), kExact, 1).track;
  EXPECT_NEAR(shownBy(turned).turn_acceleration, 1.5, 0.3);
  EXPECT_EQ(shownBy(turned).acceleration, 0.2);
}

TEST(DriveTiming, keepsTheSpeedsThatTheBaseMayHaveAtEveryRate) {
  TrackerOptions limits = limitsOf(1, 1);
  limits.speed = 0.7;
  limits.turn_speed = 1.2;
  const auto paceOf = [&](const PlanarVelocity& velocity, double rate) {
    const PoseTrack track = steady(velocity);
    return DriveTiming(track, limits, rate).paceAt(later(track.begin(), 5));
  };
  EXPECT_NEAR(paceOf({0.4, 0.5}, 1), 1, 1e-3);
  EXPECT_NEAR(paceOf({0.4, 0.5}, 2), 0.7 / 0.4, 1e-3);
  EXPECT_NEAR(paceOf({0.4, 0.9}, 1), 1, 1e-3);
  EXPECT_NEAR(paceOf({0.4, -0.9}, 2), 1.2 / 0.9, 1e-3);
  EXPECT_NEAR(paceOf({0, 2.4}, 1), 0.5, 1e-3);
  const PoseTrack track = steady({0.4, 0});
  const DriveTiming timing(track, limits, 1);
  EXPECT_EQ(timing.paceAt(later(track.end(), 5)), timing.paceAt(track.end())) << "and at its ends";
  EXPECT_EQ(timing.paceAt(later(track.begin(), -5)), timing.paceAt(track.begin()));
}

TEST(DriveTiming, refusesWhatIsNotAboveZero) {
  const PoseTrack place({{stampAt(0), {}}}, "map", true);
  EXPECT_THROW(DriveTiming(place, limitsOf(0, 1), 1), std::invalid_argument);
  EXPECT_THROW(DriveTiming(place, limitsOf(1, 1), 0), std::invalid_argument);
}

TEST(TimedDrive, endsAtItsEndAtEveryRate) {
  for (const double ramp : {0.5, 1.0}) {
    for (const double delay : {0.04, 0.08, 0.14}) {
      const DriveFaults base = rampingBase(ramp, delay);
      const RecordedDrive recorded = record(rampedDrive(1.2, 0.45, 0.5), base, kExact, 1);
      for (const double rate : {1.0, 1.5, 2.0}) {
        SCOPED_TRACE(testing::Message() << ramp << " m/s^2, " << delay << " s, rate " << rate);
        const Again again(recorded, base, limitsOf(ramp, rate));
        EXPECT_EQ(again.replay.tracker.state(), BaseState::Done);
        EXPECT_LT(again.beyond, 0.02);
        EXPECT_LT(again.backward, 0.02);
        EXPECT_LT(again.peak, 0.45 * rate * 1.06);
        EXPECT_LT(again.replay.endError(), 0.01);
      }
    }
  }
}

TEST(TimedDrive, endsAtItsEndThoughItWasToldToStandAtOnce) {
  for (const double ramp : {0.5, 1.0}) {
    for (const double delay : {0.04, 0.08, 0.14}) {
      const DriveFaults base = rampingBase(ramp, delay);
      const RecordedDrive recorded = record(abruptDrive(), base, kExact, 1);
      for (const double rate : {1.0, 2.0}) {
        SCOPED_TRACE(testing::Message() << ramp << " m/s^2, " << delay << " s, rate " << rate);
        const Again again(recorded, base, limitsOf(ramp, rate));
        EXPECT_EQ(again.replay.tracker.state(), BaseState::Done);
        EXPECT_LT(again.beyond, 0.02);
        EXPECT_LT(again.peak, 0.8 * 1.06 * rate);
        EXPECT_LT(again.replay.endError(), 0.01);
      }
    }
  }
}

TEST(TimedDrive, endsAtItsEndByWhatTheRecordingShowsOfItsBase) {
  const DriveFaults base = rampingBase(0.5);
  const RecordedDrive recorded = record(abruptDrive(), base, kExact, 1);
  const Again again(recorded, base, limitsOf(shownBy(recorded.track).acceleration, 1.5));
  EXPECT_LT(again.beyond, 0.02);
  EXPECT_LT(again.replay.endError(), 0.01);
}

TEST(TimedDrive, endsAtItsEndAfterItWasHaltedOnItsWay) {
  const DriveFaults base = rampingBase(1);
  const RecordedDrive recorded = record(abruptDrive(), base, kExact, 1);
  test::Replay replay(recorded, limitsOf(1, 1), {}, base);
  replay.runUntil(2.2);
  replay.tracker.rest();
  replay.robot.command(replay.now(), {});
  for (int i = 0; i < 200; ++i) {
    (void)replay.seen.look(replay.now(), replay.robot);
    replay.robot.step(replay.now());
    ++replay.steps;
  }
  double beyond = 0, peak = 0;
  while (!replay.isOver()) {
    replay.step();
    beyond = std::max(beyond, between(recorded.end, replay.robot.truth()).x);
    peak = std::max(peak, replay.robot.velocity().forward);
  }
  EXPECT_LT(beyond, 0.02);
  EXPECT_LT(peak, 0.85);
}

}  // namespace
}  // namespace afterglow::replay::drive_timing_test

// A recording with stands, driven again by a BaseDrive as the player has it: 50 steps a second, a
// timeline that does not pass the limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "replay/motion/base/base_drive.hpp"
#include "replay/motion/planar_pose.hpp"
#include "tests/support/simulated_replay.hpp"

namespace afterglow::replay::base_drive_test {
namespace {

using namespace test;

constexpr double kPlayerStep = 0.02;  // s

/// Ahead, a turn and back: three drives.
Commands threeDrives() {
  Commands commands;
  stand(commands, 1.5);
  drive(commands, 1, 0.1);
  stand(commands, 2);
  turn(commands, 90 * kDegree);
  stand(commands, 0.3);  // no stand of its own
  turn(commands, 30 * kDegree);
  stand(commands, 1.5);
  drive(commands, -0.8, 0);
  stand(commands, 1.5);
  return commands;
}

RecordedDrive exactly(const Commands& commands) { return record(commands, {}, kExact, 1); }

const Bytes kTwist(sizeof(Velocity));

struct Playing {
  const RecordedDrive& recorded;
  SimulatedDrive robot;
  SimulatedLocalization seen;
  BaseDrive base;
  double now = 0, rate = 1;
  Stamp at;
  std::optional<Stamp> held_at;  ///< by a goal, say
  bool hears_localization = true;
  PlanarVelocity command;
  double largest_lead = 0;  ///< s of the timeline, before the base
  double fastest = 0;       ///< m/s

  explicit Playing(const RecordedDrive& drive, const PlanarPose& start_error = {},
                   const DriveFaults& faults = {}, const TrackerOptions& options = {},
                   const LocalizationFaults& localization = kExact)
      : recorded(drive),
        robot(compose(drive.start, start_error), {5, -3, 2}, faults, 3),
        seen(localization, 4),
        base("/cmd_vel", kTwist, drive.track, drive.track.begin(), drive.track.end(), options,
             [this](Stamp) { return look(); }) {
    enter(drive.track.begin());
  }

  BaseInput look() {
    const auto map = seen.look(now, robot);
    return {stampAt(now), StampedPose{stampAt(now), robot.odometry()},
            hears_localization ? map : std::nullopt};
  }
  void enter(Stamp stamp) {
    at = stamp;
    base.enter(stamp);
  }
  void step() {
    (void)seen.look(now, robot);
    Stamp next{at.ns + static_cast<std::int64_t>(kPlayerStep * rate * 1e9)};
    if (held_at) next = std::min(next, *held_at);
    at = std::max(at, std::min({next, base.limit(), recorded.track.end()}));
    if (base.isBusy(at)) {
      const BaseDrive::Step done = base.step(at, held_at && at >= *held_at, rate, stampAt(now));
      command = done.command.value_or(command);
      robot.command(now, command);
      EXPECT_EQ(done.limit, base.limit());
    }
    if (const auto progress = base.progress()) {
      largest_lead = std::max(largest_lead, secondsBetween(*progress, at));
    }
    for (int i = 0; i < 2; ++i, now += kStep) robot.step(now);
    fastest = std::max(fastest, std::abs(robot.velocity().forward));
  }
  /// Somebody carries it there; localization sees it.
  void carryTo(const PlanarPose& pose) {
    robot.push(pose);
    for (int i = 0; i < 50; ++i, now += kStep) {
      (void)look();
      robot.step(now);
    }
  }
  void runUntil(Stamp stamp) {
    for (int i = 0; i < 10'000 && at < stamp && base.failure().empty(); ++i) step();
  }
  void run() {
    runUntil(recorded.track.end());
    for (int i = 0; i < 50 || (i < 1000 && base.isBusy(at)); ++i) step();
  }
  double endError() const { return distance(robot.truth(), recorded.end); }
  double offTrack(Stamp stamp) const { return distance(robot.truth(), recorded.track.at(stamp)); }
};

Stamp middleOf(const DriveReport& drive) { return {(drive.begin.ns + drive.end.ns) / 2}; }

TEST(BaseDrive, meetsATimelineThatHasGotAheadOfIt) {
  const RecordedDrive recorded = exactly(threeDrives());
  TrackerOptions options;
  options.turn_acceleration = 5;
  Playing playing(recorded, {}, {}, options);
  const double begin = 2.5;  // s; in the first drive, of 10 s
  playing.runUntil({recorded.track.begin().ns + static_cast<std::int64_t>(begin * 1e9)});
  playing.at.ns += 40'000'000;  // as after a step that came late
  for (int i = 0; i < 5; ++i) playing.step();
  EXPECT_GT(secondsBetween(*playing.base.progress(), playing.at), 0.03);
  for (int i = 0; i < 60; ++i) playing.step();
  EXPECT_LT(secondsBetween(*playing.base.progress(), playing.at), 0.005);
}

TEST(BaseDrive, drivesFromStandToStandAndHoldsTheTimelineUntilItIsThere) {
  const RecordedDrive recorded = exactly(threeDrives());
  Playing playing(recorded, {0.03, -0.02, 0.03}, {1.02, 0.98, 0.02, 0.1});
  playing.run();
  const BaseDriveReport report = playing.base.report();
  ASSERT_EQ(report.drives.size(), 3u) << report.lost;
  for (const DriveReport& drive : report.drives) {
    EXPECT_EQ(drive.state, BaseState::Done);
    EXPECT_LT(drive.base.end_distance, 0.03);
    EXPECT_GE(drive.base.approach, 0.45);
  }
  EXPECT_LT(playing.endError(), 0.01);
  EXPECT_LT(playing.largest_lead, 0.065);
  EXPECT_GT(report.delay, 1.5);
  EXPECT_NEAR(report.length, 1.85, 0.1);
  EXPECT_TRUE(report.is_localized);
  EXPECT_EQ(report.frame, "map");
}

TEST(BaseDrive, failsWhereItEndsFartherFromWhereItHadStoodThanItIsKnown) {
  Commands commands;
  stand(commands, 1.5);
  drive(commands, 1, 0);
  stand(commands, 4);
  const RecordedDrive recorded = exactly(commands);
  for (const double rolled : {0., 0.6}) {  // s
    TrackerOptions options;
    options.approach.most_attempts = 0;
    Playing playing(recorded, {}, {}, options);
    const auto approaches = [&] {
      const auto drives = playing.base.report().drives;
      return !drives.empty() && drives.back().state == BaseState::Approaching;
    };
    while (!approaches()) playing.step();
    for (double until = playing.now + rolled; playing.now < until; playing.now += kStep) {
      playing.robot.command(playing.now, {-0.25, 0});
      playing.robot.step(playing.now);
    }
    playing.run();
    const std::string& why = playing.base.failure();
    EXPECT_EQ(why.find("m and 0 deg from where it had stood") != std::string::npos, rolled > 0)
        << why;
    EXPECT_EQ(why.empty(), rolled == 0) << why;
  }
}

TEST(BaseDrive, isWhereItShouldBeAsFarAsANoisyLocalizationCanTell) {
  Commands commands;
  stand(commands, 1.5);
  drive(commands, 1, 0);
  stand(commands, 4);
  const RecordedDrive recorded = record(commands, {}, k3Cm, 1);
  const BaseDriveReport report = [&] {
    Playing playing(recorded, {}, {}, {}, k3Cm);
    playing.run();
    EXPECT_EQ(playing.base.failure(), "");
    return playing.base.report();
  }();
  ASSERT_EQ(report.drives.size(), 1u);
  EXPECT_GT(report.drives[0].base.end_doubt.position, 0.01);
}

/// A base goes on before a timeline that is late by a little, and no farther, in recorded time.
TEST(BaseDrive, goesNoFartherThanAFewHundredthsOfASecondBeforeTheTimeline) {
  const RecordedDrive recorded = exactly(threeDrives());
  for (const double rate : {0.5, 2.0}) {
    Playing playing(recorded);
    playing.rate = rate;
    playing.runUntil({recorded.track.begin().ns + 2'500'000'000});
    playing.held_at.reset();
    for (int i = 0; i < 50; ++i, playing.now += kPlayerStep) {
      playing.command = playing.base.step(playing.at, false, rate, stampAt(playing.now))
                            .command.value_or(PlanarVelocity());
      playing.robot.command(playing.now, playing.command);
      for (int k = 0; k < 2; ++k) playing.robot.step(playing.now + k * kStep);
    }
    EXPECT_NEAR(secondsBetween(playing.at, *playing.base.progress()), 0.06 * rate, 1e-3) << rate;
  }
}

TEST(BaseDrive, tellsHowLongItsDrivesTake) {
  const RecordedDrive recorded = exactly(threeDrives());
  const Playing playing(recorded);
  const auto timings = playing.base.timings(2);
  ASSERT_EQ(timings.size(), 3u);
  for (const BaseDrive::Timing& timing : timings) {
    EXPECT_GT(timing.seconds, secondsBetween(timing.begin, timing.end) / 2 + 0.1);
    EXPECT_LT(timing.seconds, secondsBetween(timing.begin, timing.end) + 0.1);
  }
}

TEST(BaseDrive, isIdleBetweenDrives) {
  const RecordedDrive recorded = exactly(threeDrives());
  Playing playing(recorded);
  EXPECT_FALSE(playing.base.isBusy(playing.at));
  EXPECT_EQ(playing.base.limit(), playing.base.nextBegin());
  EXPECT_NEAR(secondsBetween(recorded.track.begin(), playing.base.nextBegin()), 1.55, 0.15);
  playing.runUntil(playing.base.nextBegin());
  EXPECT_TRUE(playing.base.isBusy(playing.at));
  while (playing.base.isBusy(playing.at)) playing.step();
  EXPECT_EQ(playing.command.forward, 0);
  EXPECT_GT(playing.base.nextBegin(), playing.at);
  EXPECT_FALSE(playing.base.progress());
}

TEST(BaseDrive, standsWhileSomethingElseHoldsTheTimeline) {
  const RecordedDrive recorded = exactly(threeDrives());
  Playing playing(recorded);
  playing.held_at = Stamp{recorded.track.begin().ns + 2'500'000'000};
  playing.runUntil(*playing.held_at);
  for (int i = 0; i < 100; ++i) playing.step();
  EXPECT_EQ(playing.robot.velocity().forward, 0);
  EXPECT_EQ(playing.command.forward, 0);
  EXPECT_LT(playing.offTrack(playing.at), 0.3);  // what it takes to brake
  playing.held_at.reset();
  playing.run();
  EXPECT_EQ(playing.base.failure(), "");
  EXPECT_LT(playing.endError(), 0.01);
}

TEST(BaseDrive, drivesAtOtherRatesAndAfterAPause) {
  const RecordedDrive recorded = exactly(threeDrives());
  Playing playing(recorded);
  playing.runUntil({recorded.track.begin().ns + 2'200'000'000});
  playing.base.rest();
  playing.robot.command(playing.now, {});
  for (int i = 0; i < 200; ++i, playing.now += kStep) {
    (void)playing.look();
    playing.robot.step(playing.now);
  }
  EXPECT_EQ(playing.robot.velocity().forward, 0);
  EXPECT_GT(std::exchange(playing.fastest, 0), 0.3);
  playing.rate = 0.5;
  playing.largest_lead = 0;
  playing.run();
  EXPECT_LT(playing.largest_lead, 0.05) << "half as much as at rate 1";
  EXPECT_LT(playing.fastest, 0.3);  // 0.5 when it was recorded
  EXPECT_EQ(playing.base.failure(), "");
  EXPECT_LT(playing.endError(), 0.01);
}

TEST(BaseDrive, returnsToTheTrackAfterASeekAndRefusesFromFarAway) {
  const RecordedDrive recorded = exactly(threeDrives());
  Playing playing(recorded);
  playing.run();
  const auto drives = playing.base.report().drives;
  ASSERT_EQ(drives.size(), 3u);
  playing.carryTo(compose(recorded.track.at(middleOf(drives[2])), {0.1, 0.25, 1}));
  playing.enter(middleOf(drives[2]));
  EXPECT_TRUE(playing.base.isBusy(playing.at));
  while (playing.at == middleOf(drives[2])) playing.step();
  EXPECT_LT(playing.offTrack(playing.at), 0.02);
  playing.run();
  EXPECT_LT(playing.endError(), 0.01);
  EXPECT_EQ(playing.base.report().drives.size(), 4u);

  playing.carryTo(compose(recorded.start, {0, 2, 0}));
  playing.enter(recorded.track.begin());
  for (int i = 0; i < 300 && playing.base.failure().empty(); ++i) playing.step();
  EXPECT_EQ(playing.base.failure(), "the base is 2.00 m and 0 deg off its track");
  EXPECT_FALSE(playing.base.isBusy(playing.at));
  EXPECT_EQ(playing.command.forward, 0);
  EXPECT_EQ(playing.base.report().lost, playing.base.failure());
}

TEST(BaseDrive, keepsItsPlaceFromDriveToDriveOnOdometryAlone) {
  const RecordedDrive recorded = exactly(threeDrives());
  TrackerOptions options;
  options.with_localization = false;
  Playing playing(recorded, {}, {}, options);
  playing.hears_localization = false;
  playing.runUntil(playing.base.nextBegin());
  while (playing.base.isBusy(playing.at)) playing.step();
  // Rolled away by hand: the wheels have felt it, and the next drive begins with it.
  playing.robot.command(playing.now, {-0.2, 0});
  for (int i = 0; i < 100; ++i, playing.now += kStep) playing.robot.step(playing.now);
  playing.run();
  EXPECT_EQ(playing.base.failure(), "");
  EXPECT_LT(playing.endError(), 0.01);
  EXPECT_FALSE(playing.base.report().is_localized);
}

TEST(BaseDrive, knowsByOdometryAloneWhereItIsWhenItIsMovedBeforeItsFirstDrive) {
  const RecordedDrive recorded = exactly(threeDrives());
  TrackerOptions options;
  options.with_localization = false;
  Playing playing(recorded, {}, {}, options);
  playing.enter(recorded.track.end());  // far from there
  for (int i = 0; i < 10; ++i) playing.step();
  EXPECT_NE(playing.base.failure(), "");
  EXPECT_LT(distance(playing.robot.truth(), recorded.start), 0.01);
}

TEST(BaseDrive, drivesOnlyThePartThatIsPlayed) {
  const RecordedDrive recorded = exactly(threeDrives());
  const Stamp begin{recorded.track.begin().ns + 2'500'000'000};
  const Stamp end{begin.ns + 1'000'000'000};
  const auto look = [](Stamp now) { return BaseInput{now, {}, {}}; };
  BaseDrive part("/cmd_vel", kTwist, recorded.track, begin, end, {}, look);
  ASSERT_TRUE(part.hasDrives());
  part.enter(begin);
  EXPECT_EQ(part.nextBegin(), begin);
  EXPECT_LT(part.report().length, 0.6);

  BaseDrive before("/cmd_vel", kTwist, recorded.track, recorded.track.begin(),
                   {recorded.track.begin().ns + 1'000'000'000}, {}, look);
  EXPECT_FALSE(before.hasDrives());
}

TEST(BaseDrive, takesAShakenBaseForOneThatStands) {
  Commands commands;
  stand(commands, 2);
  commands.insert(commands.end(), 5, PlanarVelocity{0.05, 0});
  commands.insert(commands.end(), 5, PlanarVelocity{-0.05, 0});
  stand(commands, 2);
  const RecordedDrive recorded = exactly(commands);
  EXPECT_GE(recorded.track.stands.size(), 1u);
  const BaseDrive base("/cmd_vel", kTwist, recorded.track, recorded.track.begin(),
                       recorded.track.end(), {}, [](Stamp now) {
                         return BaseInput{now, {}, {}};
                       });
  EXPECT_FALSE(base.hasDrives());
}

TEST(BaseDrive, saysWhatItWaitsForAndGivesUp) {
  const RecordedDrive recorded = exactly(threeDrives());
  Playing playing(recorded);
  playing.runUntil({recorded.track.begin().ns + 2'500'000'000});
  playing.hears_localization = false;
  playing.step();
  playing.step();
  EXPECT_EQ(playing.base.reason(), "no localization");
  EXPECT_EQ(playing.command.forward, 0);
  playing.run();
  EXPECT_EQ(playing.base.failure(), "no localization");
  EXPECT_GT(playing.base.report().waited, 9);
}

TEST(BaseDrive, commandsInTheRecordedType) {
  const RecordedDrive recorded = exactly(threeDrives());
  Bytes stamped(16 + 4 + sizeof(Velocity));  // header with the frame "base"
  stamped[12] = 4;
  std::copy_n("base", 4, stamped.begin() + 16);
  const BaseDrive base("/cmd_vel", stamped, recorded.track, recorded.track.begin(),
                       recorded.track.end(), {}, [](Stamp now) {
                         return BaseInput{now, {}, {}};
                       });
  const Bytes message = base.message({0.5, -0.25}, Stamp::fromParts(77, 5));
  ASSERT_EQ(message.size(), stamped.size());
  EXPECT_EQ(velocityOf(message), (Velocity{0.5, 0, 0, 0, 0, -0.25}));
  EXPECT_EQ(message[4], 77);
  EXPECT_EQ(message[8], 5);
  EXPECT_EQ(message[16], 'b');
  EXPECT_THROW(BaseDrive("/cmd_vel", Bytes(4), recorded.track, {}, {}, {}, {}),
               std::invalid_argument);
}

}  // namespace
}  // namespace afterglow::replay::base_drive_test

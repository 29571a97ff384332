// Whether and how fast a base may drive, and whole drives among things and people.
#include "replay/motion/base/obstacle_stop.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/simulated_replay.hpp"
#include "tests/support/simulated_scan.hpp"

namespace afterglow::replay::obstacle_stop_test {
namespace {

using namespace test;
using Kind = ObstacleStop::Verdict::Kind;

constexpr double kScanPeriod = 1 / 15., kJudgePeriod = 0.02;  // s
constexpr PlanarVelocity kAhead{0.5, 0};

ObstacleOptions roundBase() {
  ObstacleOptions options;
  options.footprint = Footprint::circle(0.3);
  options.deceleration = 0.75;
  return options;
}

/// A base that stands at the origin and would like to drive on.
struct Standing {
  ObstacleStop stop{roundBase(), "map"};
  double now = 0, next_scan = 0;
  std::uint32_t scans = 0;
  ScanShape shape{-1.92, 0.0058, 663, 0.01};
  std::vector<Disc> discs;
  std::function<void(RangeScan&)> disturb = [](RangeScan&) {};
  bool has_scan = true;
  double scan_period = kScanPeriod;
  PlanarVelocity wanted = kAhead;

  ObstacleStop::Verdict judge() {
    stop.move(stampAt(now), {});
    if (has_scan && now >= next_scan) {
      RangeScan ranges = rangesOf(discs, {}, now, shape, ++scans);
      disturb(ranges);
      stop.hear(std::make_shared<FloorScan>(
          ranges, ScanMount{{kLaserAhead, 0}, {1, 0}, {0, 1}}, nullptr, std::vector<OwnPart>{}));
      next_scan += scan_period;
    }
    const auto verdict = stop.judge({stampAt(now), {}, {}, stampAt(now), kJudgePeriod},
                                    pathOf(wanted, 0.3, stop.lookAhead()));
    now += kJudgePeriod;
    return verdict;
  }
  ObstacleStop::Verdict judgeFor(double seconds) {
    ObstacleStop::Verdict verdict;
    for (const double end = now + seconds; now < end;) verdict = judge();
    return verdict;
  }
};

TEST(ObstacleStop, goesAsFastAsItCanStopBeforeWhatItSees) {
  EXPECT_EQ(Standing().judgeFor(0.2).speed, ObstacleStop::kFastest) << "nothing is there";
  EXPECT_NEAR(Standing().stop.wayToStop(0.6), 0.6 * 0.2 + 0.36 / (2 * 0.75), 1e-9);
  for (const double at : {1.3, 1.1, 0.8}) {
    Standing base;
    base.discs = {{at, 0.1, 0.1}};
    const auto verdict = base.judgeFor(0.3);
    ASSERT_EQ(verdict.kind, Kind::Go) << at;
    const double way = verdict.speed * 0.2 + verdict.speed * verdict.speed / (2 * 0.75);
    EXPECT_LT(way, at - 0.1 - 0.3 - 0.15 + 0.03) << at;
    EXPECT_GT(way, at - 0.1 - 0.3 - 0.15 - 0.07) << at;
  }
}

TEST(ObstacleStop, looksBeyondItsPathAsFarAsItWouldRoll) {
  Standing base;
  base.discs = {{1, 0, 0.1}};
  (void)base.judgeFor(0.2);
  const auto judge = [&](double speed) {
    const PlanarVelocity sent{speed, 0};
    return base.stop.judge({stampAt(base.now), {}, {}, {}, kJudgePeriod}, pathOf(kAhead, 0.3, 0.2),
                           pathOf(sent, 0.3, base.stop.wayToStop(speed)));
  };
  EXPECT_EQ(judge(0.4).speed, ObstacleStop::kFastest) << "the path ends far enough before it";
  EXPECT_LT(judge(0.9).speed, 0.7) << "but a base as fast as that does not";
}

TEST(ObstacleStop, waitsGoesOnWhenTheWayIsFreeAndNotBefore) {
  Standing base;
  base.discs = {{0.5, 0, 0.1}};
  auto verdict = base.judgeFor(1);
  EXPECT_EQ(verdict.kind, Kind::Wait);
  EXPECT_EQ(verdict.speed, 0);
  EXPECT_EQ(verdict.reason.find("something stands 0."), 0u) << verdict.reason;
  EXPECT_NE(verdict.reason.find("at (0."), std::string::npos) << verdict.reason;
  base.discs.clear();
  EXPECT_EQ(base.judgeFor(0.3).kind, Kind::Wait) << "free for too short a time";
  verdict = base.judgeFor(0.4);
  EXPECT_EQ(verdict.kind, Kind::Go);
  EXPECT_EQ(verdict.reason, "");
  const ObstacleReport report = base.stop.report();
  ASSERT_EQ(report.waits.size(), 1u);
  EXPECT_NEAR(report.waits[0].seconds, 1.6, 0.15);
  EXPECT_NEAR(report.waits[0].distance, 0.1, 0.04);
  EXPECT_NEAR(report.waits[0].place.x, 0.4, 0.04);
}

TEST(ObstacleStop, endsAWaitWhereTheBaseRests) {
  Standing base;
  base.discs = {{0.5, 0, 0.1}};
  EXPECT_EQ(base.judgeFor(1).kind, Kind::Wait);
  base.stop.rest();
  ASSERT_EQ(base.stop.report().waits.size(), 1u);
  base.discs.clear();
  EXPECT_EQ(base.judgeFor(0.2).kind, Kind::Go) << "it begins anew, and the way is free";
  base.stop.rest();
  EXPECT_EQ(base.stop.report().waits.size(), 1u) << "it was not waiting";
}

TEST(ObstacleStop, beginsAnewWithOdometryWhoseClockWasSetBack) {
  Standing base;
  base.stop.move(stampAt(50), {10, 0, 0});
  base.discs = {{0.5, 0, 0.1}};
  EXPECT_EQ(base.judgeFor(1).kind, Kind::Wait) << "what it sees is not taken to be 10 m away";
}

TEST(ObstacleStop, doesNotFlickerWhereSomethingStandsAtTheEdge) {
  Standing base;
  int changes = 0;
  Kind last = Kind::Go;
  base.discs = {{0.3 + 0.15 + 0.1 + 0.01, 0, 0.1}};  // the noise is as large as what is left
  for (int i = 0; i < 400; ++i) {
    const Kind kind = base.judge().kind;
    changes += kind != last;
    last = kind;
  }
  EXPECT_LE(changes, 1);
}

TEST(ObstacleStop, givesUpAfterItsPatience) {
  Standing base;
  base.discs = {{0.5, 0, 0.1}};
  EXPECT_EQ(base.judgeFor(14.9).kind, Kind::Wait);
  const auto verdict = base.judgeFor(0.3);
  EXPECT_EQ(verdict.kind, Kind::GiveUp);
  EXPECT_NE(verdict.reason.find("that is so for 15 s"), std::string::npos) << verdict.reason;
}

TEST(ObstacleStop, seesAThinLegThreeMetersAwayAndNearBy) {
  for (const double at : {1.2, 1.0, 0.6}) {  // as far as it looks ahead
    Standing base;
    base.discs = {{at, 0.05, 0.01}};
    EXPECT_LT(base.judgeFor(0.5).speed, ObstacleStop::kFastest) << at;
  }
  // One beam alone meets it there.
  ObstacleOptions options = roundBase();
  options.deceleration = 0.2;  // it looks farther
  ObstacleStop stop(options, "map");
  for (int i = 0; i < 3; ++i) {
    stop.hear(scanOf({{2.9, 0, 0.015}}, {}, 0.1 * i, {-1.92, 0.0058, 663, 0}));
  }
  const auto verdict =
      stop.judge({stampAt(0.2), {}, {}, {}, 0.02}, pathOf(kAhead, 0.3, 3));
  EXPECT_NEAR(verdict.distance, 2.9 - 0.3, 0.05);
}

TEST(ObstacleStop, isNotStoppedBySpeckle) {
  for (const std::size_t width : {1u, 2u}) {  // beams
    Standing base;
    std::mt19937 random(4);
    base.disturb = [&](RangeScan& scan) {  // one in a hundred or two hundred, anywhere
      for (std::size_t i = 0; i + width <= scan.ranges.size(); ++i) {
        if (random() % (100 * width) != 0) continue;
        const float range = 0.4f + 2e-9f * static_cast<float>(random());
        std::fill_n(scan.ranges.begin() + static_cast<std::ptrdiff_t>(i), width, range);
      }
    };
    int stops = 0;
    for (int i = 0; i < 500; ++i) stops += base.judge().kind != Kind::Go;
    EXPECT_LT(stops, 50) << width;
  }
}

TEST(ObstacleStop, takesAThingToBeWhereItWasWhenTheScanWasTaken) {
  ObstacleStop stop(roundBase(), "map");
  for (int i = 0; i <= 10; ++i) {  // at 1 m/s
    stop.move(stampAt(0.02 * i), {0.02 * i, 0, 0});
    if (i == 0) stop.hear(scanOf({{1.5, 0, 0.1}}, {}, 0));
  }
  stop.hear(scanOf({{1.5, 0, 0.1}}, {}, 0.0));
  const PlanarPose now{0.2, 0, 0};
  EXPECT_NEAR(stop.judge({stampAt(0.2), now, now, {}, 0.02}, pathOf(kAhead, 0.3, 3)).distance,
              1.4 - 0.2 - 0.3, 0.01);
}

TEST(ObstacleStop, standsWithoutAScanAndWithOneThatSeesNothing) {
  Standing base;
  EXPECT_EQ(base.judgeFor(0.6).kind, Kind::Go);
  base.has_scan = false;  // it dies
  EXPECT_EQ(base.judgeFor(0.2).kind, Kind::Go);
  auto verdict = base.judgeFor(0.2);
  EXPECT_EQ(verdict.kind, Kind::Wait);
  EXPECT_EQ(verdict.reason.find("no scan for 0."), 0u) << verdict.reason;
  base.has_scan = true;
  EXPECT_EQ(base.judgeFor(1).kind, Kind::Go);
  base.disturb = [](RangeScan& scan) {
    for (float& range : scan.ranges) range = std::nanf("");
  };
  verdict = base.judgeFor(0.2);
  EXPECT_EQ(verdict.kind, Kind::Wait);
  EXPECT_EQ(verdict.reason, "the scan sees nothing at all");
  Standing never;
  never.has_scan = false;
  EXPECT_EQ(never.judge().kind, Kind::Wait);
}

TEST(ObstacleStop, waitsForNoSlowScanAndSoonForAFastOne) {
  Standing slow, fast;
  slow.scan_period = 0.2;
  fast.scan_period = 0.025;
  for (int i = 0; i < 250; ++i) {
    ASSERT_EQ(slow.judge().kind, Kind::Go) << slow.now;
    ASSERT_EQ(fast.judge().kind, Kind::Go) << fast.now;
  }
  slow.has_scan = fast.has_scan = false;
  EXPECT_EQ(slow.judgeFor(0.7).kind, Kind::Go);
  EXPECT_EQ(slow.judgeFor(0.35).kind, Kind::Wait);
  EXPECT_EQ(fast.judgeFor(0.15).kind, Kind::Go);
  EXPECT_EQ(fast.judgeFor(0.08).kind, Kind::Wait);
}

TEST(ObstacleStop, keepsFartherAwayFromWhatMoves) {
  Standing standing, walking;
  standing.discs = walking.discs = {{1.2, -0.7, 0.1}};
  EXPECT_EQ(standing.judgeFor(1).speed, ObstacleStop::kFastest) << "the way passes it";
  (void)walking.judgeFor(0.6);
  for (int i = 0; i < 30; ++i) {  // at 1 m/s toward the way, and there it stands
    walking.discs[0].y = -1.3 + 0.02 * i;
    (void)walking.judge();
  }
  EXPECT_LT(walking.judge().speed, 0.8);
  EXPECT_EQ(walking.judgeFor(1.2).speed, ObstacleStop::kFastest);
}

TEST(ObstacleStop, isSlowWhereNobodyLooks) {
  Standing base;
  base.wanted = {-0.5, 0};
  const auto verdict = base.judgeFor(0.3);
  EXPECT_EQ(verdict.kind, Kind::Go);
  EXPECT_DOUBLE_EQ(verdict.speed, 0.2);
  EXPECT_TRUE(verdict.is_unseen);
}

// ------------------------------------------------------------------------------------ whole drives

/// A drive of 2.5 m straight on, by a base that looks.
struct Drive {
  RecordedDrive recorded = record(commands(), {}, kExact, 1);
  test::Replay replay;
  std::function<std::vector<Disc>(double now)> discs = [](double) { return std::vector<Disc>(); };
  double scans_end = 1e9, next_scan = 0, nearest = 1e9, fastest_back = 0;
  std::shared_ptr<const FloorScan> scan;
  std::vector<std::string> reasons;

  static Commands commands() {
    Commands commands;
    drive(commands, 2.5, 0);
    return commands;
  }
  static TrackerOptions options() {
    TrackerOptions options;
    options.obstacles = roundBase();
    return options;
  }

  explicit Drive(const TrackerOptions& with = options()) : replay(recorded, with) {
    replay.disturb = [this](double now, BaseInput& input) {
      if (now >= next_scan && now < scans_end) {
        // In the base's frame as it is now.
        scan = scanOf(discs(now), replay.robot.truth(), now, {-1.92, 0.0058, 663, 0.01},
                      static_cast<std::uint32_t>(now * 100) + 1);
        next_scan = now + kScanPeriod;
      }
      input.scan = scan;
      for (const Disc& disc : discs(now)) {
        const FloorPoint seen = fromBase({disc.x, disc.y, 0});
        nearest = std::min(nearest, std::hypot(seen.x, seen.y) - disc.radius - 0.3);
      }
      const std::string& reason = replay.tracker.reason();
      if (!reason.empty() && (reasons.empty() || reasons.back() != reason)) {
        reasons.push_back(reason);
      }
    };
  }
  FloorPoint fromBase(const PlanarPose& place) const {
    const PlanarPose seen = between(replay.robot.truth(), place);
    return {seen.x, seen.y};
  }
  /// A place on the track, so many m from its begin and to its left.
  Disc onTrack(double along, double left, double radius) const {
    const PlanarPose at = compose(recorded.start, {along, left, 0});
    return {at.x, at.y, radius};
  }
};

TEST(ObstacleStop, changesNothingWhereNobodyIsInTheWay) {
  Drive with;
  with.discs = [&](double) {
    return std::vector<Disc>{with.onTrack(1.2, 0.8, 0.2), with.onTrack(3.5, 0, 0.1)};
  };
  with.replay.run();
  test::Replay without(with.recorded, {});
  without.run();
  EXPECT_EQ(with.replay.tracker.state(), BaseState::Done) << with.replay.tracker.reason();
  EXPECT_EQ(with.replay.steps, without.steps);
  EXPECT_LT(with.replay.endError(), 0.01);
  EXPECT_TRUE(with.replay.tracker.report().obstacles.waits.empty());
}

TEST(ObstacleStop, haltsTheBaseBeforeWhatStandsOnItsTrackUntilItIsTakenAway) {
  Drive drive;
  drive.discs = [&](double now) {
    return now < 9 ? std::vector<Disc>{drive.onTrack(1.6, 0.1, 0.1)} : std::vector<Disc>();
  };
  drive.replay.runUntil(8.9);
  EXPECT_EQ(drive.replay.robot.velocity().forward, 0);
  const double stood = between(drive.recorded.start, drive.replay.robot.truth()).x;
  drive.replay.run();
  EXPECT_GT(drive.nearest, 0.14);
  EXPECT_LT(drive.nearest, 0.25);
  EXPECT_NEAR(stood, 1.6 - 0.1 - 0.3 - 0.18, 0.06);
  EXPECT_EQ(drive.replay.tracker.state(), BaseState::Done) << drive.replay.tracker.reason();
  EXPECT_LT(drive.replay.endError(), 0.01);
  EXPECT_LT(drive.replay.largest, 0.1) << "along the same track";
  const BaseReport report = drive.replay.tracker.report();
  ASSERT_EQ(report.obstacles.waits.size(), 1u);
  EXPECT_GT(report.obstacles.waits[0].seconds, 3);
  EXPECT_NEAR(report.obstacles.waits[0].distance, 0.17, 0.04);
  ASSERT_FALSE(drive.reasons.empty());
}

TEST(ObstacleStop, letsAPersonWalkThrough) {
  Drive drive;
  drive.discs = [&](double now) {  // two legs that step, at 1.2 m/s across the track
    const double walked = -2.4 + 1.2 * (now - 1);
    return std::vector<Disc>{drive.onTrack(1.9, walked, 0.06),
                             drive.onTrack(2.0, walked + 0.2 * std::sin(6 * now), 0.06)};
  };
  drive.replay.run();
  EXPECT_EQ(drive.replay.tracker.state(), BaseState::Done) << drive.replay.tracker.reason();
  EXPECT_GT(drive.nearest, 0.3);
  EXPECT_LT(drive.replay.endError(), 0.01);
}

TEST(ObstacleStop, brakesForWhoStepsInAtOnce) {
  Drive drive;
  drive.discs = [&](double now) {  // 0.8 m ahead of a base at full speed, for a while
    return now > 2.5 && now < 5 ? std::vector<Disc>{drive.onTrack(1.95, 0, 0.15)}
                                : std::vector<Disc>();
  };
  drive.replay.run();
  EXPECT_GT(drive.nearest, 0.1);
  EXPECT_EQ(drive.replay.tracker.state(), BaseState::Done) << drive.replay.tracker.reason();
}

TEST(ObstacleStop, doesNotKeepABaseFromAnEndAQuarterMeterBeforeAWall) {
  for (const double rate : {1.0, 1.5, 2.0}) {
    TrackerOptions options = Drive::options();
    options.rate = rate;
    options.acceleration = 0.75;
    Drive drive(options);
    drive.discs = [&](double) {
      return std::vector<Disc>{drive.onTrack(2.5 + 0.3 + 0.25 + 1, 0, 1)};
    };
    drive.replay.run();
    EXPECT_EQ(drive.replay.tracker.state(), BaseState::Done) << drive.replay.tracker.reason();
    EXPECT_LT(drive.replay.endError(), 0.01) << rate;
    EXPECT_GT(drive.nearest, 0.23) << rate;
    EXPECT_TRUE(drive.replay.tracker.report().obstacles.waits.empty()) << rate;
  }
}

TEST(ObstacleStop, losesTheBaseWhenWhatStandsThereStays) {
  Drive drive;
  drive.discs = [&](double) { return std::vector<Disc>{drive.onTrack(1.5, 0, 0.1)}; };
  drive.replay.run();
  EXPECT_EQ(drive.replay.tracker.state(), BaseState::Lost);
  EXPECT_NE(drive.replay.tracker.reason().find("something stands 0."), std::string::npos);
  EXPECT_EQ(drive.replay.robot.velocity().forward, 0);
}

TEST(ObstacleStop, haltsTheBaseWhenTheScanDies) {
  Drive drive;
  drive.scans_end = 2;
  drive.replay.runUntil(2.2);
  EXPECT_NE(drive.replay.command.forward, 0);
  drive.replay.runUntil(2.5);
  EXPECT_EQ(drive.replay.command.forward, 0);
  drive.replay.runUntil(3.5);
  EXPECT_EQ(drive.replay.robot.velocity().forward, 0);
  EXPECT_EQ(drive.replay.tracker.reason().find("no scan for"), 0u);
}

TEST(ObstacleStop, leavesABaseWhereItIsWhoseLastCentimetersAreBarred) {
  Drive drive;
  const auto see = drive.replay.disturb;
  double approaches_at = 0;
  const auto approaches = [&] { return drive.replay.tracker.state() == BaseState::Approaching; };
  drive.replay.disturb = [&](double now, BaseInput& input) {
    see(now, input);
    if (!approaches()) return;
    if (approaches_at == 0) approaches_at = now;
    PlanarPose& seen = input.T_map_odom->pose;  // localization says that it is 3 cm short
    seen.x -= 0.03 * std::cos(drive.recorded.end.yaw);
    seen.y -= 0.03 * std::sin(drive.recorded.end.yaw);
  };
  drive.discs = [&](double) {
    return approaches() ? std::vector<Disc>{drive.onTrack(2.5 + 0.3 + 0.05 + 0.1, 0, 0.1)}
                        : std::vector<Disc>();
  };
  drive.replay.runUntil(60);
  EXPECT_EQ(drive.replay.tracker.state(), BaseState::Done) << drive.replay.tracker.reason();
  EXPECT_GT(drive.replay.now() - approaches_at, 3);
  EXPECT_LT(drive.replay.now() - approaches_at, 8) << "it does not wait for long";
  EXPECT_GT(drive.nearest, 0.03);
}

TEST(ObstacleStop, drivesBackwardAsRecordedButSlowly) {
  Commands commands;
  drive(commands, -1, 0);
  const RecordedDrive recorded = record(commands, {}, kExact, 1);
  test::Replay replay(recorded, Drive::options());
  double fastest = 0;
  replay.disturb = [&](double now, BaseInput& input) {
    input.scan = scanOf({}, replay.robot.truth(), now);
    fastest = std::min(fastest, replay.robot.velocity().forward);
  };
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_GT(fastest, -0.21);
  EXPECT_LT(replay.endError(), 0.01);
  EXPECT_NEAR(replay.tracker.report().obstacles.unseen, 1, 0.1);
}

TEST(ObstacleStop, doesNotBackUpToAPlaceThatNobodySees) {
  const PoseTrack place({{stampAt(0), {1.4, 1, 0.3}}}, "map", true);  // 0.6 m behind
  RecordedDrive to{{2, 1, 0.3}, {1.4, 1, 0.3}, {{2, 1, 0.3}}, place, {}};
  TrackerOptions options = Drive::options();
  options.lost_distance = 1;
  test::Replay replay(to, options);
  double back = 0;
  replay.disturb = [&](double now, BaseInput& input) {
    input.scan = scanOf({}, replay.robot.truth(), now);
    back = std::min(back, replay.robot.velocity().forward);
  };
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(replay.endError(), 0.02);
  EXPECT_GT(back, -0.06) << "but for the last centimeters";
}

/// Ahead 1 m, with a rest on the way; somebody pushes the base on by 0.35 m at the given moment.
struct PushedAhead {
  RecordedDrive recorded;
  BaseState state = BaseState::Following;
  double end_distance = 0;
  double back = 0;  ///< m that it went backward

  PushedAhead(double pushed_at, bool is_holonomic) : recorded(made()) {
    TrackerOptions options = Drive::options();
    options.is_holonomic = is_holonomic;
    DriveFaults faults;
    faults.manners.is_holonomic = is_holonomic;
    test::Replay replay(recorded, options, {}, faults);
    bool is_pushed = false;
    replay.disturb = [&](double now, BaseInput& input) {
      input.scan = scanOf({}, replay.robot.truth(), now);
      back += std::max(0.0, -replay.robot.velocity().forward) * 3 * kStep;
      if (now < pushed_at || std::exchange(is_pushed, true)) return;
      replay.robot.push(compose(replay.robot.truth(), {0.35, 0, 0}));
    };
    replay.run();
    state = replay.tracker.state();
    end_distance = replay.tracker.report().end_distance;
  }
  static RecordedDrive made() {
    Commands commands;
    drive(commands, 0.5, 0);
    stand(commands, 0.8);
    drive(commands, 0.5, 0);
    return record(commands, {}, kExact, 1);
  }
};

TEST(ObstacleStop, doesNotBackUpWhereNobodySeesThoughSomebodyPushedItAhead) {
  for (const bool is_holonomic : {false, true}) {
    for (const double pushed_at : {0.6, 4.2}) {  // beyond the rest, beyond the end
      const PushedAhead pushed(pushed_at, is_holonomic);
      EXPECT_LT(pushed.back, 0.03) << is_holonomic;
      EXPECT_EQ(pushed.state, BaseState::Lost);
    }
    const PushedAhead late_in_the_first_half(2.0, is_holonomic);
    EXPECT_LT(late_in_the_first_half.back, 0.03) << is_holonomic;
    EXPECT_EQ(late_in_the_first_half.state, BaseState::Done) << "the track comes by";
    EXPECT_LT(late_in_the_first_half.end_distance, 0.02);
  }
}

}  // namespace
}  // namespace afterglow::replay::obstacle_stop_test

// The last centimeters of a drive: what they mend, and how far the base turns for it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "replay/motion/base/base_tracker.hpp"
#include "replay/motion/base/final_approach.hpp"
#include "tests/support/simulated_replay.hpp"
#include "tests/support/simulated_scan.hpp"

namespace afterglow::replay::final_approach_test {
namespace {

using namespace test;

constexpr double kTick = 0.02;  // s
constexpr double kSmall = 0.19;  // rad: the small turn, and what a step is too far
constexpr HeadingRange kStraight{0, 0};

constexpr PlanarPose kGoal{3, -2, 2.5};

/// A base that does at once as it is told, next to a goal; all as seen from there.
struct Approached {
  double least = 0, most = 0;  // rad, that it pointed at
  double fastest_turn = 0;     // rad/s
  PlanarPose end;
  bool is_over = false, is_left_aside = false;
  int attempts = 0;

  Approached(const PlanarPose& from, const HeadingRange& headings) : end(from) {
    FinalApproach approach(kGoal, {}, headings);
    for (double now = 0; now < 120; now += kTick) {
      const auto velocity = approach.step(compose(kGoal, end), 0.001, 0.001, kTick);
      is_over = !velocity;
      if (is_over) break;
      fastest_turn = std::max(fastest_turn, std::abs(velocity->turn));
      end = advance(end, *velocity, kTick);
      least = std::min(least, end.yaw);
      most = std::max(most, end.yaw);
    }
    is_left_aside = approach.isLeftAside();
    attempts = approach.attempts();
  }
  double error() const { return std::hypot(end.x, end.y); }
};

/// All around the goal, up to some centimeters off.
std::vector<PlanarPose> places() {
  std::vector<PlanarPose> places;
  for (const double length : {0.008, 0.014, 0.05}) {
    for (double bearing = -kPi; bearing < kPi; bearing += 0.3) {
      places.push_back({length * std::cos(bearing), length * std::sin(bearing), 0});
    }
  }
  return places;
}

/// Seconds until a base beside the goal begins its first move, which never ends, as it is stuck;
/// and until it gives up. `known`: how well its place and yaw are, at a moment.
struct Stuck {
  double begins = 0, ends = 0;  // s
  int attempts = 0;

  explicit Stuck(const std::function<PoseError(double now)>& known) {
    FinalApproach approach({}, {});
    for (double now = kTick; ends == 0 && now < 120; now += kTick) {
      const PoseError error = known(now);
      const auto velocity = approach.step({-0.05, 0, 0}, error.position, error.yaw, kTick);
      if (velocity && !velocity->isZero() && begins == 0) begins = now;
      if (!velocity) ends = now;
      attempts = approach.attempts();
    }
  }
};

TEST(FinalApproach, looksOnceItKnowsItsPlaceOrLearnsNoMore) {
  const auto begins = [](const std::function<PoseError(double)>& known) {
    return Stuck(known).begins;
  };
  EXPECT_NEAR(begins([](double) { return PoseError{0.005, 0.004}; }), 0.5, 0.05);
  EXPECT_NEAR(begins([](double) { return PoseError{0.05, 0.004}; }), 1.5, 0.05);
  EXPECT_NEAR(begins([](double) { return PoseError{0.005, 0.05}; }), 1.5, 0.05);
  EXPECT_NEAR(begins([](double now) {
                return PoseError{0.05 - 0.005 * now, 0.004};
              }),
              6, 0.05)
      << "it still learns";
  EXPECT_NEAR(begins([](double now) { return PoseError{0.05 - 0.02 * now, 0.004}; }), 2.2, 0.05);
}

TEST(FinalApproach, leavesABaseAloneThatStandsWithinItsTolerances) {
  const auto attempts = [](const PlanarPose& base) {
    FinalApproach approach({}, {});
    for (double now = 0; now < 1; now += kTick) (void)approach.step(base, 0.001, 0.001, kTick);
    return approach.attempts();
  };
  for (const double sign : {-1., 1.}) {
    EXPECT_EQ(attempts({sign * 0.006, 0, 0}), 0);
    EXPECT_EQ(attempts({sign * 0.0061, 0, 0}), 1);
    EXPECT_EQ(attempts({0.006, sign * 0.003, 0}), 0) << "as near as a straight move would bring it";
    EXPECT_EQ(attempts({0.006, sign * 0.0031, 0}), 1);
    EXPECT_EQ(attempts({0, 0, sign * 0.004}), 0);
    EXPECT_EQ(attempts({0, 0, sign * 0.0041}), 1);
  }
}

TEST(FinalApproach, givesUpABaseThatIsStuck) {
  const Stuck stuck([](double) { return PoseError{0.001, 0.001}; });
  EXPECT_EQ(stuck.attempts, 3);
  EXPECT_NEAR(stuck.ends, 3 * 15 + 4 * 0.5, 0.3);
}

TEST(FinalApproach, isSoSlowNearItsGoalThatAQuarterOfASecondMoreDoesNotPassIt) {
  for (const PlanarPose& from : {PlanarPose{-0.3, 0, 0}, {0.2, 0, 0}, {0, 0, 0.4}, {0, 0, -0.2}}) {
    for (const bool is_holonomic : {false, true}) {
      FinalApproach approach({}, {}, FinalApproach::kAnywhere, is_holonomic);
      PlanarPose base = from;
      int moves = 0;
      while (const auto velocity = approach.step(base, 0.001, 0.001, kTick)) {
        EXPECT_LE(velocity->speed(), 0.1 + 1e-9);
        EXPECT_LE(0.25 * velocity->speed(), std::hypot(base.x, base.y) + 1e-9);
        EXPECT_LE(0.25 * std::abs(velocity->turn), std::abs(base.yaw) + 1e-9);
        base = advance(base, *velocity, kTick);
        if (++moves > 2000) break;
      }
      EXPECT_LT(moves, 1000);
      EXPECT_LT(std::hypot(base.x, base.y), 0.006);
      EXPECT_LT(std::abs(base.yaw), 0.004);
    }
  }
}

TEST(FinalApproach, avoidsToDriveWhereNobodyLooksFartherThanATenthOfAMeter) {
  struct Approach {
    double back = 0, turned = 0;
    bool is_left_aside = false;
    PlanarPose end;
    Approach(const PlanarPose& from, const HeadingRange& headings, bool is_holonomic) : end(from) {
      FinalApproach approach({}, {}, headings, is_holonomic);
      approach.avoidUnseen(true);
      for (int i = 0; i < 3000; ++i) {
        const auto velocity = approach.step(end, 0.001, 0.001, kTick);
        if (!velocity) break;
        back = std::max(back, -velocity->forward);
        end = advance(end, *velocity, kTick);
        turned = std::max(turned, std::abs(end.yaw));
      }
      is_left_aside = approach.isLeftAside();
    }
    double error() const { return std::hypot(end.x, end.y); }
  };
  const Approach near({0.1, 0, 0}, kStraight, false), far({0.2, 0, 0}, kStraight, false);
  EXPECT_LT(near.error(), 0.006);
  EXPECT_GT(near.back, 0);
  EXPECT_TRUE(far.is_left_aside);
  EXPECT_EQ(far.back, 0);
  const Approach round({0.2, 0, 0}, FinalApproach::kAnywhere, false);
  EXPECT_LT(round.error(), 0.0075);
  EXPECT_GT(round.turned, kPi / 2) << "it looks where it drives";
  const Approach ahead({-0.2, 0, 0}, kStraight, false);
  EXPECT_LT(ahead.error(), 0.006);
  EXPECT_FALSE(ahead.is_left_aside);
  EXPECT_TRUE(Approach({0, 0.2, 0}, kStraight, true).is_left_aside);
  EXPECT_LT(Approach({0.06, 0.06, 0.1}, kStraight, true).error(), 0.006);
}

TEST(FinalApproach, leavesAnErrorBesideAStraightEndRatherThanTurnFarForIt) {
  const Approached beside({0.004, -0.014, 0}, kStraight);  // a turn by 74 degrees would mend it
  EXPECT_TRUE(beside.is_over);
  EXPECT_TRUE(beside.is_left_aside);
  EXPECT_EQ(beside.attempts, 0);
  EXPECT_EQ(beside.fastest_turn, 0);
}

TEST(FinalApproach, turnsByTenDegreesAtMostWhereTheRecordedBaseDidNot) {
  for (const PlanarPose& place : places()) {
    const Approached straight(place, kStraight);
    EXPECT_TRUE(straight.is_over);
    EXPECT_GT(straight.least, -kSmall) << place.x << " " << place.y;
    EXPECT_LT(straight.most, kSmall) << place.x << " " << place.y;
    EXPECT_LE(straight.fastest_turn, 0.3 + 1e-9);
    EXPECT_LT(std::abs(straight.end.x), 0.0075) << place.x << " " << place.y << ": this is mended";
    EXPECT_LE(std::abs(straight.end.y), std::abs(place.y) + 1e-3);
    EXPECT_EQ(straight.is_left_aside, straight.error() > 0.006) << place.x << " " << place.y;
  }
}

TEST(FinalApproach, turnsAsTheRecordedBaseDidThereAndMendsAllByThat) {
  const HeadingRange quarter{0, kPi / 2};
  for (const PlanarPose& place : places()) {
    const Approached turned(place, quarter);
    EXPECT_TRUE(turned.is_over);
    EXPECT_FALSE(turned.is_left_aside) << place.x << " " << place.y;
    EXPECT_GT(turned.least, -kSmall);
    EXPECT_LT(turned.most, kPi / 2 + kSmall);
    EXPECT_LT(turned.error(), 0.0075) << place.x << " " << place.y;
    EXPECT_LT(std::abs(turned.end.yaw), 0.01);
  }
}

TEST(FinalApproach, turnsToAPlaceAsItHasTo) {
  const Approached place({0, 0.3, 0}, FinalApproach::kAnywhere);
  EXPECT_TRUE(place.is_over);
  EXPECT_LT(place.error(), 0.0075);
  EXPECT_GT(std::max(place.most, -place.least), kPi / 4);
}

/// Looks again after 0.1 m or 0.25 rad only, as amcl, and is off by 2 cm each time.
struct Amcl {
  Bell bell;
  PlanarPose looked_at = {};
  std::optional<PlanarPose> known = {};

  StampedPose look(double now, const SimulatedDrive& drive) {
    const PlanarPose moved = between(looked_at, drive.odometry());
    if (!known || std::hypot(moved.x, moved.y) > 0.1 || std::abs(moved.yaw) > 0.25) {
      looked_at = drive.odometry();
      const PlanarPose truth = drive.truth(), off = bell.pose(0.02, 0.01);
      known = compose({truth.x + off.x, truth.y + off.y, truth.yaw + off.yaw},
                      inverse(drive.odometry()));
    }
    return {stampAt(now), *known};
  }
};

TEST(FinalApproach, goesToAStartWithoutTurningForEveryCentimeter) {
  for (const PlanarPose& from : {PlanarPose{0, 0.3, 0}, PlanarPose{0.25, 0.15, 0}}) {
    const double bearing = std::abs(std::atan2(from.y, -from.x));
    for (std::uint32_t seed = 1; seed < 6; ++seed) {
      const PoseTrack place({{stampAt(0), {2, 1, 0.3}}}, "map", true);
      const RecordedDrive to{{2, 1, 0.3}, {2, 1, 0.3}, {{2, 1, 0.3}}, place, {}};
      TrackerOptions options;
      options.lost_distance = 1;
      options.approach = approachOfStart();
      options.obstacles.emplace();
      Replay replay(to, options, from, {1.01, 0.99, 0.02, 0.08}, kExact, seed);
      Amcl amcl{Bell(seed + 100)};
      double turned = 0;
      replay.disturb = [&](double now, BaseInput& input) {
        input.scan = scanOf({}, replay.robot.truth(), now);
        input.T_map_odom = amcl.look(now, replay.robot);
        turned += std::abs(replay.robot.velocity().turn) * 3 * kStep;
      };
      replay.run();
      EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
      EXPECT_LT(turned, 2 * bearing + 0.2) << from.x << " " << seed;
      EXPECT_LT(replay.now(), 30) << from.x << " " << seed;
      EXPECT_LT(replay.endError(), 0.06) << from.x << " " << seed;
    }
  }
}

TEST(FinalApproach, knowsFromTheTrackWhereTheBasePointedAtItsEnd) {
  Commands commands;
  drive(commands, 1, 0);
  turn(commands, 100 * kDegree);
  drive(commands, 0.5, 0);
  const PoseTrack straight = record(commands, {}, kExact, 1).track;
  EXPECT_NEAR(straight.headingsAtEnd(0.05).from, 0, 0.02) << "it turned elsewhere";
  EXPECT_NEAR(straight.headingsAtEnd(0.05).to, 0, 0.02);
  turn(commands, 60 * kDegree);
  turn(commands, -90 * kDegree);
  const PoseTrack turned = record(commands, {}, kExact, 1).track;
  EXPECT_NEAR(turned.headingsAtEnd(0.05).from, 0, 0.02);
  EXPECT_NEAR(turned.headingsAtEnd(0.05).to, 90 * kDegree, 0.05);
}

TEST(FinalApproach, ofAStraightDriveHardlyTurnsWhateverLocalizationSays) {
  Commands commands;
  drive(commands, 2, 0);
  const RecordedDrive recorded = record(commands, {}, kExact, 1);
  for (std::uint32_t seed = 1; seed < 6; ++seed) {
    Replay replay(recorded, {}, {0, 0.03, 0}, {1.01, 0.99, 0.02, 0.08}, k3Cm, seed);
    double farthest = 0;
    replay.disturb = [&](double, BaseInput&) {
      if (replay.tracker.state() != BaseState::Approaching) return;
      const double turned = wrapAngle(replay.robot.truth().yaw - recorded.end.yaw);
      farthest = std::max(farthest, std::abs(turned));
    };
    replay.run();
    EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
    EXPECT_LT(farthest, 16 * kDegree) << seed;
    EXPECT_LT(replay.endError(), 0.06) << seed;
  }
}

}  // namespace
}  // namespace afterglow::replay::final_approach_test

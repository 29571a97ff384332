#include "replay/motion/base/base_obedience.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <string>

namespace afterglow::replay::base_obedience_test {
namespace {

constexpr double kStep = 0.02;  // s, of commands and odometry

Stamp at(double seconds) { return {static_cast<std::int64_t>(seconds * 1e9)}; }

double approach(double from, double to, double most) {
  return from + std::clamp(to - from, -most, most);
}

/// A base that ramps, as a Fetch's does.
struct Base {
  BaseObedience watch{ObedienceOptions{}};
  double now = 100, clock = 5000;  ///< s; its own clock is another one
  PlanarPose pose;
  PlanarVelocity velocity, pushed;
  double latency = 0.1, deceleration = 0.75;
  std::deque<PlanarVelocity> coming;

  /// The first complaint while it is told so; empty: none.
  std::string drive(const std::function<PlanarVelocity(double)>& command, double seconds) {
    for (double t = 0; t < seconds; t += kStep) {
      const PlanarVelocity told = command(t);
      watch.told(at(now), {told.forward, 0, 0, 0, 0, told.turn});
      coming.push_back(told);
      PlanarVelocity wanted = {};
      if (coming.size() > latency / kStep) {
        wanted = coming.front();
        coming.pop_front();
      }
      const bool brakes = std::abs(wanted.forward) < std::abs(velocity.forward);
      velocity.forward =
          approach(velocity.forward, wanted.forward, (brakes ? deceleration : 0.75) * kStep);
      velocity.turn = approach(velocity.turn, wanted.turn, 3 * kStep);
      pose = advance(pose,
                     {velocity.forward + pushed.forward, velocity.turn + pushed.turn, pushed.left},
                     kStep);
      now += kStep;
      clock += kStep;
      const std::string complaint = watch.moved(at(now), at(clock), pose);
      if (!complaint.empty()) return complaint;
    }
    return "";
  }
  std::string drive(PlanarVelocity command, double seconds) {
    return drive([=](double) { return command; }, seconds);
  }
};

TEST(BaseObedience, believesABaseThatRampsAndIsLate) {
  for (const double latency : {0.0, 0.1, 0.3}) {
    Base base;
    base.latency = latency;
    EXPECT_EQ(base.drive({1.0, 2.0}, 3), "");
    EXPECT_EQ(base.drive({0, 0}, 3), "") << "to a stand, which takes 1.3 s";
    EXPECT_EQ(base.drive({-0.6, -2.0}, 3), "");
    EXPECT_EQ(base.drive({0.6, 2.0}, 3), "") << "the other way at once";
    const auto swinging = [](double t) {
      return PlanarVelocity{0.5 + 0.4 * std::sin(2 * t), 1.5 * std::sin(3 * t)};
    };
    EXPECT_EQ(base.drive(swinging, 10), "");
    EXPECT_EQ(base.drive({0, 0}, 10), "");
  }
}

TEST(BaseObedience, believesOneThatIsSlowedDownBeforeAnObstacle) {
  Base base;
  EXPECT_EQ(base.drive({0.6, 0}, 2), "");
  base.pushed.forward = -0.5;
  EXPECT_EQ(base.drive({0.6, 0}, 5), "") << "0.1 m/s";
}

TEST(BaseObedience, noticesWhoPushesABaseThatStands) {
  Base base;
  ASSERT_EQ(base.drive({0, 0}, 2), "");
  base.pushed.forward = 0.3;
  const double before = base.now;
  EXPECT_EQ(base.drive({0, 0}, 5),
            "the base moves otherwise than told: 0.30 m/s and 0.00 rad/s instead of 0.00 and "
            "0.00");
  EXPECT_LT(base.now - before, 0.8);
}

TEST(BaseObedience, noticesWhoDrivesOrTurnsItAnotherWay) {
  Base base;
  ASSERT_EQ(base.drive({0.5, 0}, 3), "");
  base.pushed.forward = -0.8;
  EXPECT_NE(base.drive({0.5, 0}, 1.5), "") << "backwards";
  base = Base();
  ASSERT_EQ(base.drive({0.5, 0}, 3), "");
  base.pushed.turn = 0.5;
  EXPECT_NE(base.drive({0.5, 0}, 1.5), "");
}

TEST(BaseObedience, believesABaseThatBrakesGently) {
  Base base;
  base.deceleration = 0.4;
  EXPECT_EQ(base.drive({1, 0}, 3), "");
  EXPECT_EQ(base.drive({0, 0}, 4), "");
}

TEST(BaseObedience, noticesWhatIsFasterThanItsTolerancesAlone) {
  const auto pushed = [](const PlanarVelocity& command, const PlanarVelocity& push) {
    Base base;
    EXPECT_EQ(base.drive(command, 3), "");
    base.pushed = push;
    return !base.drive(command, 2).empty();
  };
  EXPECT_FALSE(pushed({0, 0}, {0.12, 0}));
  EXPECT_TRUE(pushed({0, 0}, {0.2, 0}));
  EXPECT_FALSE(pushed({0, 0}, {0, 0.25}));
  EXPECT_TRUE(pushed({0, 0}, {0, 0.35}));
  EXPECT_FALSE(pushed({0, 0}, {0, 0, 0.12}));
  EXPECT_TRUE(pushed({0, 0}, {0, 0, -0.2})) << "to the right";
  EXPECT_FALSE(pushed({1, 3}, {0.25, 0})) << "0.15 m/s and 15 % of what it is told, on a bend";
  EXPECT_TRUE(pushed({1, 3}, {0.35, 0}));
}

TEST(BaseObedience, bearsABaseThatIsToldNothingMoreForAWhile) {
  Base base;
  ASSERT_EQ(base.drive({1, 0}, 3), "");
  const auto roll = [&](double seconds) {
    std::string complaint;
    for (double t = 0; t < seconds && complaint.empty(); t += kStep) {
      base.pose = advance(base.pose, {1, 0}, kStep);
      base.now += kStep, base.clock += kStep;
      complaint = base.watch.moved(at(base.now), at(base.clock), base.pose);
    }
    return complaint;
  };
  EXPECT_EQ(roll(2.2), "") << "1.5 s, and what it takes to stop";
  EXPECT_NE(roll(1), "");
}

TEST(BaseObedience, letsABaseStandForAWhileFromTheTimeItShouldMove) {
  Base base;
  EXPECT_EQ(base.drive({0, 0}, 1), "");
  base.latency = 100;
  EXPECT_EQ(base.drive({0.5, 0}, 2.9), "") << "half a second until it moves, and 2.5 s";
  EXPECT_NE(base.drive({0.5, 0}, 0.3), "");
}

TEST(BaseObedience, noticesABaseThatDoesNotMove) {
  Base base;
  base.latency = 100;
  EXPECT_EQ(base.drive({0.5, 0}, 2), "");
  EXPECT_EQ(base.drive({0.5, 0}, 2),
            "the base stands, though it is told to move, 0.50 m/s and 0.00 rad/s");
  base = Base();
  base.latency = 100;
  EXPECT_EQ(base.drive({0.02, 0}, 20), "") << "too slow for some floors";
}

TEST(BaseObedience, bearsAnOdometryThatJumps) {
  Base base;
  ASSERT_EQ(base.drive({0.3, 0}, 2), "");
  base.pose.x += 5;
  EXPECT_EQ(base.drive({0.3, 0}, 2), "");
  base.clock -= 1000;
  EXPECT_EQ(base.drive({0.3, 0}, 2), "");
}

TEST(BaseObedience, keepsTheTimeOfASimulation) {
  Base base;
  ASSERT_EQ(base.drive({0.5, 0}, 3), "");
  base.now -= 50;  // set back
  EXPECT_EQ(base.drive({0.5, 0}, 3), "");
  EXPECT_EQ(base.drive({0, 0}, 3), "");
}

}  // namespace
}  // namespace afterglow::replay::base_obedience_test

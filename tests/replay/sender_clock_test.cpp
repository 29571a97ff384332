// Wall clocks that are set while a robot drives.
#include "replay/clock/clock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "tests/support/simulated_replay.hpp"

namespace afterglow::replay::sender_clock_test {
namespace {

using namespace test;

constexpr std::int64_t kMs = 1'000'000;

Stamp ms(std::int64_t milliseconds) { return {milliseconds * kMs}; }

TEST(SenderClock, takesTheShortestDelayForNone) {
  SenderClock clock;
  EXPECT_EQ(clock.heard(ms(5'000'030), ms(100)), ms(100));
  EXPECT_EQ(clock.count(), 1);
  EXPECT_EQ(clock.heard(ms(5'000'050), ms(115)), ms(115)) << "5 ms sooner";
  EXPECT_EQ(clock.count(), 2);
  EXPECT_NEAR(static_cast<double>(clock.heard(ms(5'000'070), ms(200))->ns), 135e6, 1e6) << "late";
}

TEST(SenderClock, knowsNoNewsFromAMessageThatWasOvertakenNorTwoFromALatchedOne) {
  SenderClock clock;
  clock.heard(ms(1000), ms(100));
  clock.heard(ms(1000), ms(200));
  EXPECT_EQ(clock.count(), 1);
  clock.heard(ms(1020), ms(120));
  EXPECT_FALSE(clock.heard(ms(1010), ms(125)));
}

TEST(SenderClock, staysInStepWhenTheClockIsSetAheadAndBack) {
  for (const std::int64_t step : {10'000, -10'000}) {
    SenderClock clock;
    for (std::int64_t at = 0; at < 2000; at += 20) {
      const std::int64_t set = at < 1000 ? 0 : step;
      const auto heard = clock.heard(ms(700'000 + at + set), ms(at + 3));
      ASSERT_TRUE(heard) << at;
      EXPECT_LE(std::abs(heard->ns - ms(at + 3).ns), kMs) << at << " " << step;
    }
  }
}

TEST(SenderClock, followsAClockThatGoesWrongByAnHour) {
  for (const double drift : {5e-4, -5e-4}) {
    SenderClock clock;
    for (std::int64_t at = 0; at < 3'600'000; at += 100) {
      const auto stamp = static_cast<std::int64_t>(static_cast<double>(at) * (1 + drift) * 1e6);
      const auto heard = clock.heard({stamp + 700'000'000'000'000}, ms(at));
      ASSERT_TRUE(heard);
      ASSERT_LE(std::abs(heard->ns - ms(at).ns), 2 * kMs) << at;
    }
  }
}

TEST(ClockStepDetector, noticesThatTheWallClockIsSetAndNotThatTimePasses) {
  ClockStepDetector watch;
  EXPECT_FALSE(watch.hasStepped(ms(1'000'000), ms(0)));
  EXPECT_FALSE(watch.hasStepped(ms(1'060'010), ms(60'000)));
  EXPECT_TRUE(watch.hasStepped(ms(1'070'020), ms(60'010)));
  EXPECT_FALSE(watch.hasStepped(ms(1'070'120), ms(60'110)));
  EXPECT_TRUE(watch.hasStepped(ms(1'060'220), ms(60'210)));
}

/// The commands of a detour whose odometry is dated by a wall clock that is set as said.
std::vector<PlanarVelocity> commandsOf(const RecordedDrive& recorded, std::int64_t ahead_ns,
                                       std::int64_t back_ns) {
  Replay replay(recorded, {}, {}, {1.01, 0.99, 0.02, 0.08});
  SenderClock clock;
  std::vector<PlanarVelocity> commands;
  replay.disturb = [&](double now, BaseInput& input) {
    commands.push_back(replay.command);
    const std::int64_t set = now < 3 ? 0 : now < 6 ? ahead_ns : back_ns;
    const Stamp wall{input.T_odom_base->stamp.ns + set};
    input.T_odom_base->stamp = clock.heard(wall, input.now).value_or(Stamp{});
  };
  replay.run();
  EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
  EXPECT_LT(replay.endError(), 0.012);
  EXPECT_LT(replay.tracker.report().waited, 0.1) << "until localization is seen first";
  return commands;
}

TEST(SenderClock, letsABaseDriveOnAsIfTheWallClockHadNotBeenSet) {
  const RecordedDrive recorded = record(detour(), {}, kExact, 1);
  const std::vector<PlanarVelocity> steady = commandsOf(recorded, 0, 0);
  constexpr std::int64_t kTenSeconds = 10'000'000'000;
  for (const std::int64_t ahead : {kTenSeconds, -kTenSeconds}) {
    const std::vector<PlanarVelocity> set = commandsOf(recorded, ahead, -ahead);
    ASSERT_EQ(set.size(), steady.size());
    for (std::size_t i = 0; i < set.size(); ++i) {
      ASSERT_NEAR(set[i].forward, steady[i].forward, 0.01) << i;
      ASSERT_NEAR(set[i].turn, steady[i].turn, 0.03) << i;
    }
  }
}

}  // namespace
}  // namespace afterglow::replay::sender_clock_test

#include "replay/motion/base/drive_timing.hpp"

#include <gtest/gtest.h>

namespace afterglow::replay::base_command_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr CommandLimits kLimits{{1, 2, 0.5, 4}, 0.1, 0.3};

Stamp ms(std::int64_t milliseconds) { return {milliseconds * kMs}; }

TEST(BaseCommand, changesWithinItsAccelerationAndStaysWithinItsSpeed) {
  BaseCommand command(kLimits);
  command.change({3, -1}, 0.1);
  EXPECT_DOUBLE_EQ(command.velocity().forward, 0.05);
  EXPECT_DOUBLE_EQ(command.velocity().turn, -0.4);
  command.change({3, -9}, 100);
  EXPECT_DOUBLE_EQ(command.velocity().forward, 1);
  EXPECT_DOUBLE_EQ(command.velocity().turn, -2);
  command.slow(0.25);
  EXPECT_DOUBLE_EQ(command.velocity().turn / command.velocity().forward, -2) << "the same curve";
  command.halt();
  EXPECT_FALSE(command.isMoving());
}

TEST(BaseCommand, knowsWhereWhatIsOnItsWayTakesTheBase) {
  BaseCommand command(kLimits);
  command.change({0.5, 0}, 100);
  command.send(ms(0));
  command.halt();
  command.send(ms(40));
  // In effect from 100 to 140 ms.
  EXPECT_NEAR(command.predict({}, ms(50), ms(120)).x, 0.5 * 0.02, 1e-9);
  EXPECT_NEAR(command.predict({}, ms(50), ms(400)).x, 0.5 * 0.04, 1e-9);
  EXPECT_NEAR(command.predict({1, 0, 0}, ms(130), ms(200)).x, 1 + 0.5 * 0.01, 1e-9);
}

TEST(BaseCommand, keepsWhatIsInEffectThoughItWasSentLongAgo) {
  BaseCommand command(kLimits);
  command.change({0.5, 0}, 100);
  command.send(ms(0));
  for (int at = 1000; at < 1200; at += 20) command.send(ms(at));
  EXPECT_NEAR(command.predict({}, ms(900), ms(1000)).x, 0.5 * 0.1, 1e-9);
}

}  // namespace
}  // namespace afterglow::replay::base_command_test

#include "replay/motion/stops/operator_stops.hpp"

#include <gtest/gtest.h>

namespace afterglow::replay::hold_to_run_test {
namespace {

SteadyTime at(std::int64_t ms) { return {ms * 1'000'000}; }

/// Every 50 ms, as a joystick that repeats itself.
void say(HoldToRun& hold, std::int64_t from_ms, std::int64_t to_ms, bool is_pressed) {
  for (std::int64_t ms = from_ms; ms <= to_ms; ms += 50) hold.heard(at(ms), is_pressed);
}

TEST(HoldToRun, needsAButtonThatIsPressedAnew) {
  HoldToRun hold;
  EXPECT_FALSE(hold.isHeld(at(0)));
  say(hold, 0, 1000, true);
  EXPECT_FALSE(hold.isHeld(at(1000))) << "it was pressed before";
  EXPECT_TRUE(hold.hasToBeReleased());
  hold.heard(at(1050), false);
  hold.heard(at(1100), true);
  EXPECT_TRUE(hold.isHeld(at(1100)));
}

TEST(HoldToRun, endsWhenTheButtonIsReleased) {
  HoldToRun hold;
  hold.heard(at(0), false);
  say(hold, 50, 500, true);
  EXPECT_TRUE(hold.isHeld(at(500)));
  hold.heard(at(510), false);
  EXPECT_FALSE(hold.isHeld(at(510)));
  EXPECT_FALSE(hold.hasFallenSilent(at(510)));
  hold.heard(at(520), true);
  EXPECT_TRUE(hold.isHeld(at(520))) << "and goes on";
}

TEST(HoldToRun, endsWhenTheJoystickFallsSilentAndDoesNotGoOnByItself) {
  HoldToRun hold;
  hold.heard(at(0), false);
  hold.heard(at(50), true);
  EXPECT_TRUE(hold.isHeld(at(350)));
  EXPECT_FALSE(hold.isHeld(at(351)));
  EXPECT_TRUE(hold.hasFallenSilent(at(351)));
  say(hold, 2000, 3000, true);
  EXPECT_FALSE(hold.isHeld(at(3000))) << "nobody knows who holds it now";
  EXPECT_TRUE(hold.hasToBeReleased());
  hold.heard(at(3050), false);
  hold.heard(at(3100), true);
  EXPECT_TRUE(hold.isHeld(at(3100)));
}

TEST(HoldToRun, isSteadyWhenAJoystickThatOnlySpeaksOnChangesWouldBeSilent) {
  HoldToRun hold;
  hold.heard(at(0), false);
  hold.heard(at(50), true);
  for (std::int64_t ms = 50; ms < 2000; ms += 10) EXPECT_FALSE(hold.isHeldSteadily(at(ms)));
  hold.heard(at(2000), false);
  say(hold, 2050, 2550, true);
  EXPECT_FALSE(hold.isHeldSteadily(at(2499)));
  EXPECT_TRUE(hold.isHeldSteadily(at(2500))) << "450 ms after it was pressed";
}

}  // namespace
}  // namespace afterglow::replay::hold_to_run_test

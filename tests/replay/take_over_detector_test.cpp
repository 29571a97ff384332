#include "replay/motion/stops/take_over_detector.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>

namespace afterglow::replay::take_over_detector_test {
namespace {

const std::string kNobody;

Stamp at(std::int64_t ms) { return {ms * 1'000'000}; }

Velocity velocity(double forward, double turn = 0) { return {forward, 0, 0, 0, 0, turn}; }

TakeOverDetector watch() { return {"/cmd_vel", {"/teleop/cmd_vel"}}; }

/// A replay that drives, whose multiplexer passes on exactly what it hears.
TakeOverDetector driving() {
  TakeOverDetector driven = watch();
  for (int i = 0; i < 10; ++i) {
    driven.told(at(i * 20), velocity(0.5 + 0.001 * i));
    EXPECT_EQ(driven.onOutput(at(i * 20 + 5), "/base/command", velocity(0.5 + 0.001 * i)),
              kNobody);
  }
  return driven;
}

TEST(TakeOverDetector, seesWhichInputAMultiplexerPassesOn) {
  EXPECT_EQ(watch().onSelected("/cmd_vel"), kNobody);
  EXPECT_EQ(watch().onSelected("/teleop/cmd_vel"),
            "somebody else drives the base on /teleop/cmd_vel");
  EXPECT_EQ(watch().onSelected("__none"), "the multiplexer of the base passes nothing on");
  EXPECT_EQ(watch().onSelected("Navigation"), kNobody) << "a name of its own";
}

TEST(TakeOverDetector, takesWhatASafetyDeviceOrAPersonSendsAtItsWord) {
  TakeOverDetector driven = driving();
  EXPECT_EQ(driven.onInput(at(300), "/teleop/cmd_vel", velocity(0)), kNobody);
  EXPECT_EQ(driven.onInput(at(300), "/navigation/cmd_vel", velocity(0.1)), kNobody);
  EXPECT_EQ(driven.onInput(at(300), "/teleop/cmd_vel", velocity(0.1)),
            "somebody else drives the base on /teleop/cmd_vel");
}

TEST(TakeOverDetector, seesOthersVelocitiesBehindTheMultiplexerAndWhoseTheyAre) {
  TakeOverDetector driven = driving();
  EXPECT_EQ(driven.onOutput(at(300), "/base/command", velocity(0.2)),
            "somebody else drives the base on /base/command")
      << "slower than told, but what was told comes out exactly";
  driven.onInput(at(300), "/joy_vel", velocity(0.3));
  EXPECT_EQ(driven.onOutput(at(310), "/base/command", velocity(0.3)),
            "somebody else drives the base on /joy_vel");
  driven.onInput(at(300), "/navigation/cmd_vel", velocity(0.4));
  EXPECT_EQ(driven.onOutput(at(800), "/base/command", velocity(0.4)),
            "somebody else drives the base on /navigation/cmd_vel")
      << "which sent just that, half a second ago";
  EXPECT_EQ(driven.onOutput(at(801), "/base/command", velocity(0.4)),
            "somebody else drives the base on /base/command");
}

TEST(TakeOverDetector, leavesAStandAlone) {
  TakeOverDetector driven = driving();
  EXPECT_EQ(driven.onOutput(at(300), "/base/command", velocity(0)), kNobody);
}

/// A replay that goes on to tell 0.5 m/s from 200 ms on, 50 times a second, while an input sends a
/// zero each 50 ms; what the multiplexer puts out, if anything, is `put_out`'s. Returns who is seen,
/// and when, ms.
template <typename PutOut>
std::pair<std::string, int> besideZeros(const PutOut& put_out) {
  TakeOverDetector driven = driving();
  for (int ms = 200; ms < 3000; ms += 10) {
    std::string seen;
    if (ms % 20 == 0) driven.told(at(ms), velocity(0.5));
    if (ms % 50 == 0) seen = driven.onInput(at(ms), "/joy_vel", velocity(0));
    if (const std::optional<Velocity> out = put_out(ms); out && seen.empty()) {
      seen = driven.onOutput(at(ms), "/base/command", *out);
    }
    if (!seen.empty()) return {seen, ms};
  }
  return {kNobody, 0};
}

TEST(TakeOverDetector, seesZerosOfAnotherInputThatSuppressWhatIsTold) {
  const auto [who, ms] = besideZeros([](int now) {
    return now % 50 == 0 ? std::optional(velocity(0)) : std::nullopt;
  });
  EXPECT_EQ(who, "somebody holds the base still on /joy_vel");
  EXPECT_GT(ms, 600) << "not by one zero, as a joystick sends it when its button is released";
  EXPECT_LT(ms, 700);
}

TEST(TakeOverDetector, leavesZerosAloneThatSuppressNothing) {
  using Out = std::optional<Velocity>;
  EXPECT_EQ(besideZeros([](int) { return Out(velocity(0.5)); }).first, kNobody)
      << "a joystick of a lower priority, or without its button";
  EXPECT_EQ(besideZeros([](int) { return Out(); }).first, kNobody) << "nobody hears the output";
  EXPECT_EQ(besideZeros([](int now) { return Out(velocity(now % 200 == 0 ? 0.5 : 0)); }).first,
            kNobody)
      << "they come out between what is told: it drives";
}

TEST(TakeOverDetector, mindsNoZeroThatIsOld) {
  TakeOverDetector driven = driving();
  driven.onInput(at(195), "/joy_vel", velocity(0));  // its button is released
  for (int ms = 200; ms < 3000; ms += 20) {
    driven.told(at(ms), velocity(0.5));
    const std::string seen =
        ms < 900 ? kNobody : driven.onOutput(at(ms), "/base/command", velocity(0));
    EXPECT_EQ(seen, kNobody) << ms;
  }
}

TEST(TakeOverDetector, beginsAnewWithAClockThatWasSetBack) {
  TakeOverDetector driven = driving();
  driven.told(at(50), velocity(0.3));
  EXPECT_EQ(driven.onOutput(at(60), "/base/command", velocity(0.3)), kNobody);
  EXPECT_EQ(driven.onOutput(at(60), "/base/command", velocity(0.509)),
            "somebody else drives the base on /base/command")
      << "that was told after this moment, by the old time";
}

TEST(TakeOverDetector, letsABaseStandThatIsToldTo) {
  TakeOverDetector driven = driving();
  for (int ms = 200; ms < 3000; ms += 20) {
    driven.told(at(ms), velocity(0));
    EXPECT_EQ(driven.onInput(at(ms), "/joy_vel", velocity(0)), kNobody);
    EXPECT_EQ(driven.onOutput(at(ms), "/base/command", velocity(0)), kNobody);
  }
}

TEST(TakeOverDetector, letsAMultiplexerThatRampsBeSlowerThanTold) {
  TakeOverDetector driven = watch();
  for (int i = 0; i < 50; ++i) {
    driven.told(at(i * 20), velocity(0.6, -0.5));
    EXPECT_EQ(driven.onOutput(at(i * 20 + 5), "/smooth", velocity(0.011 * i, -0.009 * i)),
              kNobody);
  }
  driven.told(at(1000), velocity(0));
  EXPECT_EQ(driven.onOutput(at(1500), "/smooth", velocity(0.3, -0.2)), kNobody);
  EXPECT_EQ(driven.onOutput(at(1500), "/smooth", velocity(-0.15)),
            "somebody else drives the base on /smooth");
  EXPECT_EQ(driven.onOutput(at(1980 + 1000), "/smooth", velocity(0.6)), kNobody)
      << "what was told two seconds ago";
  EXPECT_EQ(driven.onOutput(at(4500), "/smooth", velocity(0.3)),
            "somebody else drives the base on /smooth")
      << "long after it was told to stand";
}

TEST(TakeOverDetector, knowsThatAReplayThatTellsNothingDoesNotDrive) {
  TakeOverDetector idle = watch();
  EXPECT_EQ(idle.onOutput(at(0), "/base/command", velocity(0.1)),
            "somebody else drives the base on /base/command");
}

}  // namespace
}  // namespace afterglow::replay::take_over_detector_test

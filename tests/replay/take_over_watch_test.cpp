#include "replay/motion/take_over_watch.hpp"

#include <gtest/gtest.h>

namespace afterglow::replay::take_over_watch_test {
namespace {

const std::string kNobody;

Stamp at(std::int64_t ms) { return {ms * 1'000'000}; }

Velocity velocity(double forward, double turn = 0) { return {forward, 0, 0, 0, 0, turn}; }

TakeOverWatch watch() { return {"/cmd_vel", {"/teleop/cmd_vel"}}; }

/// A replay that drives, whose multiplexer passes on exactly what it hears.
TakeOverWatch driving() {
  TakeOverWatch driven = watch();
  for (int i = 0; i < 10; ++i) {
    driven.told(at(i * 20), velocity(0.5 + 0.001 * i));
    EXPECT_EQ(driven.onOutput(at(i * 20 + 5), "/base/command", velocity(0.5 + 0.001 * i)),
              kNobody);
  }
  return driven;
}

TEST(TakeOverWatch, seesWhichInputAMultiplexerPassesOn) {
  EXPECT_EQ(watch().onSelected("/cmd_vel"), kNobody);
  EXPECT_EQ(watch().onSelected("/teleop/cmd_vel"),
            "somebody else drives the base on /teleop/cmd_vel");
  EXPECT_EQ(watch().onSelected("__none"), "the multiplexer of the base passes nothing on");
  EXPECT_EQ(watch().onSelected("Navigation"), kNobody) << "a name of its own";
}

TEST(TakeOverWatch, takesWhatASafetyDeviceOrAPersonSendsAtItsWord) {
  TakeOverWatch driven = driving();
  EXPECT_EQ(driven.onInput(at(300), "/teleop/cmd_vel", velocity(0)), kNobody);
  EXPECT_EQ(driven.onInput(at(300), "/navigation/cmd_vel", velocity(0.1)), kNobody);
  EXPECT_EQ(driven.onInput(at(300), "/teleop/cmd_vel", velocity(0.1)),
            "somebody else drives the base on /teleop/cmd_vel");
}

TEST(TakeOverWatch, seesOthersVelocitiesBehindTheMultiplexerAndWhoseTheyAre) {
  TakeOverWatch driven = driving();
  EXPECT_EQ(driven.onOutput(at(300), "/base/command", velocity(0.2)),
            "somebody else drives the base on /base/command")
      << "slower than told, but what was told comes out exactly";
  driven.onInput(at(300), "/joy_vel", velocity(0.3));
  EXPECT_EQ(driven.onOutput(at(310), "/base/command", velocity(0.3)),
            "somebody else drives the base on /joy_vel");
}

TEST(TakeOverWatch, leavesAStandAlone) {
  TakeOverWatch driven = driving();
  EXPECT_EQ(driven.onOutput(at(300), "/base/command", velocity(0)), kNobody);
}

TEST(TakeOverWatch, letsAMultiplexerThatRampsBeSlowerThanTold) {
  TakeOverWatch driven = watch();
  for (int i = 0; i < 50; ++i) {
    driven.told(at(i * 20), velocity(0.6, -0.5));
    EXPECT_EQ(driven.onOutput(at(i * 20 + 5), "/smooth", velocity(0.011 * i, -0.009 * i)),
              kNobody);
  }
  driven.told(at(1000), velocity(0));
  EXPECT_EQ(driven.onOutput(at(1500), "/smooth", velocity(0.3, -0.2)), kNobody);
  EXPECT_EQ(driven.onOutput(at(1500), "/smooth", velocity(-0.15)),
            "somebody else drives the base on /smooth");
  EXPECT_EQ(driven.onOutput(at(4500), "/smooth", velocity(0.3)),
            "somebody else drives the base on /smooth")
      << "long after it was told to stand";
}

TEST(TakeOverWatch, knowsThatAReplayThatTellsNothingDoesNotDrive) {
  TakeOverWatch idle = watch();
  EXPECT_EQ(idle.onOutput(at(0), "/base/command", velocity(0.1)),
            "somebody else drives the base on /base/command");
}

}  // namespace
}  // namespace afterglow::replay::take_over_watch_test

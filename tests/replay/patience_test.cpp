#include "replay/motion/stops/patience.hpp"

#include <gtest/gtest.h>

namespace afterglow::replay::patience_test {
namespace {

constexpr std::int64_t kMs = 1'000'000, kUs = 1'000;

SteadyTime at(std::int64_t ns) { return {1'000'000 * kMs + ns}; }

TEST(BeatJitter, isKnownAfterThreeTenthsOfASecond) {
  BeatJitter jitter;
  int looks = 0;
  for (; !jitter.isKnown(); ++looks) jitter.add(at(looks * kBeatPeriod), at(looks * kBeatPeriod));
  EXPECT_EQ(looks * kBeatPeriod, 300 * kMs);
  EXPECT_EQ(jitter.lateness(), 0);
}

TEST(BeatJitter, remembersTheWorstOfTheLastSecond) {
  BeatJitter jitter;
  jitter.add(at(0), at(7 * kMs));
  for (int i = 1; i < 50; ++i) jitter.add(at(i * kBeatPeriod), at(i * kBeatPeriod + 90 * kUs));
  EXPECT_EQ(jitter.lateness(), 7 * kMs);
  jitter.add(at(50 * kBeatPeriod), at(50 * kBeatPeriod));
  EXPECT_EQ(jitter.lateness(), 90 * kUs);
}

TEST(Patience, followsHowLateTheMachineIsWithinBounds) {
  EXPECT_EQ(patienceBeside({0, 0}), 60 * kMs);
  EXPECT_EQ(patienceBeside({900 * kUs, 0}), 60 * kMs) << "a machine that is on time";
  EXPECT_EQ(patienceBeside({4500 * kUs, 0}), 100 * kMs);
  EXPECT_EQ(patienceBeside({9 * kMs, 0}), 150 * kMs);
  EXPECT_EQ(patienceBeside({200 * kMs, 0}), 150 * kMs);
}

TEST(Patience, followsHowBusyTheMachineWasOverTheLastMinuteThoughItIsPunctualNow) {
  EXPECT_EQ(patienceBeside({100 * kUs, 0.05}), 60 * kMs) << "a quiet machine";
  EXPECT_EQ(patienceBeside({100 * kUs, 0.5}), 100 * kMs);
  EXPECT_EQ(patienceBeside({100 * kUs, 0.98}), 140 * kMs) << "at load 4 on two processors";
  EXPECT_EQ(patienceBeside({5 * kMs, 0.98}), 150 * kMs);
}

TEST(Patience, isToldByTheKernelHowBusyTheMachineWas) {
  const std::string pressure =
      "some avg10=97.53 avg60=50.13 avg300=16.29 total=100134471\n"
      "full avg10=0.00 avg60=0.00 avg300=0.00 total=0\n";
  EXPECT_DOUBLE_EQ(waitingPart(pressure, "9.00 2.17 1.62 8/126 28468\n", 2), 0.9753);
  EXPECT_DOUBLE_EQ(waitingPart("some avg10=3.00 avg60=50.00 avg300=9.00 total=1\n", "", 2), 0.5);
  EXPECT_DOUBLE_EQ(waitingPart("", "3.00 2.17 1.62 8/126 28468\n", 0), 0) << "no processor is told";
  EXPECT_DOUBLE_EQ(waitingPart("", "3.00 2.17 1.62 8/126 28468\n", 2), 0.5) << "an older kernel";
  EXPECT_DOUBLE_EQ(waitingPart("", "4.38 2.17 1.62 8/126 28468\n", 2), 1);
  EXPECT_DOUBLE_EQ(waitingPart("", "0.51 2.17 1.62 8/126 28468\n", 2), 0);
  EXPECT_DOUBLE_EQ(waitingPart("", "", 2), 0) << "nothing is known";
}

TEST(Patience, isNotEnoughForAMachineThatWakesThePlayerTooLateWhichIsSaidBeforeMotion) {
  EXPECT_EQ(whyTooLate({75 * kMs, 1}), "");
  EXPECT_EQ(whyTooLate({90 * kMs, 1}),
            "this machine is busy and up to 90 ms late, and the watchdog waits 150 ms "
            "(--longest-stall, ~longest_stall allows more)");
}

TEST(Patience, bearsALostPacketOfANetworkAndNeverMoreThanASecond) {
  constexpr std::int64_t kSentAgain = 200 * kMs;
  EXPECT_GT(patienceAfar(kBeatPeriod), kBeatPeriod + kSentAgain);
  EXPECT_EQ(patienceAfar(kBeatPeriod), 300 * kMs);
  EXPECT_EQ(patienceAfar(45 * kMs), 400 * kMs);
  EXPECT_EQ(patienceAfar(900 * kMs), 1000 * kMs);
}

}  // namespace
}  // namespace afterglow::replay::patience_test

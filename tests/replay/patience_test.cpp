#include "replay/motion/patience.hpp"

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
  EXPECT_EQ(patienceBeside(0), 60 * kMs);
  EXPECT_EQ(patienceBeside(900 * kUs), 60 * kMs) << "a machine that is on time";
  EXPECT_EQ(patienceBeside(4500 * kUs), 100 * kMs);
  EXPECT_EQ(patienceBeside(9 * kMs), 150 * kMs);
  EXPECT_EQ(patienceBeside(200 * kMs), 150 * kMs);
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

#include "replay/motion/silence_monitor.hpp"

#include <gtest/gtest.h>

namespace afterglow::replay::silence_monitor_test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

SteadyTime at(std::int64_t ms) { return {ms * kMs}; }

/// Every so many ms, from 0 on.
SilenceMonitor periodic(std::int64_t period_ms, int count, const SilenceBounds& bounds = {}) {
  SilenceMonitor watch(bounds);
  for (int i = 0; i < count; ++i) watch.heard(at(i * period_ms));
  return watch;
}

TEST(SilenceMonitor, missesFivePeriodsOfATopicThatIsPeriodic) {
  const SilenceMonitor watch = periodic(100, 6);  // the last at 500
  EXPECT_EQ(watch.longestSilence(), 500 * kMs);
  EXPECT_FALSE(watch.isOverdue(at(1000)));
  EXPECT_TRUE(watch.isOverdue(at(1001)));
  EXPECT_DOUBLE_EQ(watch.silence(Stamp{1001 * kMs}), 0.501);
}

TEST(SilenceMonitor, lastsForEverOnATopicThatIsSentOnChange) {
  EXPECT_FALSE(periodic(100, 1).isOverdue(at(1'000'000'000)));
  SilenceMonitor watch;
  for (const std::int64_t ms : {0, 900, 1000, 60'000, 60'010, 200'000}) watch.heard(at(ms));
  EXPECT_FALSE(watch.longestSilence());
  EXPECT_FALSE(watch.isOverdue(at(1'000'000'000)));
}

TEST(SilenceMonitor, takesTheLongestThatIsGiven) {
  const SilenceMonitor watch = periodic(100, 1, {300 * kMs, 300 * kMs});
  EXPECT_FALSE(watch.isOverdue(at(300)));
  EXPECT_TRUE(watch.isOverdue(at(301)));
  EXPECT_EQ(periodic(100, 20, {2000 * kMs, 2000 * kMs}).longestSilence(), 2000 * kMs);
}

TEST(SilenceMonitor, isNotDeceivedByOneLateMessage) {
  SilenceMonitor watch = periodic(100, 6);
  watch.heard(at(990));
  watch.heard(at(991));
  EXPECT_EQ(watch.longestSilence(), 500 * kMs);
}

TEST(SilenceMonitor, bearsTheJitterOfAFastTopic) {
  EXPECT_EQ(periodic(2, 20).longestSilence(), 200 * kMs);
}

TEST(SilenceMonitor, boundsWhatAMotionReliesOnByItsOwnPeriod) {
  const auto longest = [](std::int64_t period_ms) {
    return periodic(period_ms, 20, kMotionSilence).longestSilence();
  };
  EXPECT_EQ(longest(2), 200 * kMs);
  EXPECT_EQ(longest(66), 330 * kMs);
  EXPECT_EQ(longest(200), 1000 * kMs);
  EXPECT_EQ(longest(500), 1000 * kMs);
  EXPECT_EQ(periodic(66, 2, kMotionSilence).longestSilence(), 1000 * kMs) << "not known yet";
}

TEST(SilenceMonitor, beginsAnewWithAClockThatWasSetBack) {
  SilenceMonitor watch = periodic(100, 6, kMotionSilence);
  watch.heard(at(-50'000));
  EXPECT_FALSE(watch.isOverdue(at(-49'900)));
  EXPECT_FALSE(watch.knowsPeriod());
}

TEST(SilenceMonitor, isNoneBeforeTheFirstMessage) {
  const SilenceMonitor watch(SilenceBounds{100 * kMs, 100 * kMs});
  EXPECT_FALSE(watch.hasBeenHeard());
  EXPECT_FALSE(watch.isOverdue(at(10'000)));
}

}  // namespace
}  // namespace afterglow::replay::silence_monitor_test

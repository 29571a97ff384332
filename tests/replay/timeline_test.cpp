#include "replay/clock/timeline.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "replay/clock/clock.hpp"
#include "replay/play/consumer_lag.hpp"
#include "replay/play/figures.hpp"

namespace afterglow::replay::timeline_test {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(FollowedClock, tellsHowFarTheOtherClockWentAndNeverGoesBack) {
  FollowedClock clock;
  EXPECT_FALSE(clock.hasTicked());
  EXPECT_EQ(clock.tick({100 * kSecond}), 0) << "where it was before is not known";
  const SteadyTime begin = clock.now();
  EXPECT_EQ(clock.tick({101 * kSecond}), kSecond);
  EXPECT_EQ(clock.tick({50 * kSecond}), -51 * kSecond);
  EXPECT_EQ(clock.tick({52 * kSecond}), 2 * kSecond);
  EXPECT_EQ(clock.now().ns - begin.ns, 3 * kSecond);
  EXPECT_EQ(clock.time().ns, 52 * kSecond);
}

TEST(Timeline, keepsRecordedIntervals) {
  const Timeline timeline({100}, 1.0, {5000});
  EXPECT_EQ(timeline.deadline({100}), SteadyTime{5000});
  EXPECT_EQ(timeline.deadline({101}), SteadyTime{5001});
  EXPECT_EQ(timeline.position({5007}).ns, 7);
}

TEST(Timeline, doesNotDriftOverAYear) {
  const std::int64_t begin = 1'700'000'000 * kSecond + 1;
  const std::int64_t year = 365 * 24 * 3600 * kSecond + 1;
  Timeline timeline({begin}, 1.0, {3});
  EXPECT_EQ(timeline.deadline({begin + year}), SteadyTime{year + 3});
}

TEST(Timeline, stretchesWithTheRate) {
  const Timeline timeline({0}, 2.0, {0});
  EXPECT_EQ(timeline.deadline({kSecond}), SteadyTime{kSecond / 2});
  EXPECT_EQ(timeline.position({kSecond}).ns, 2 * kSecond);
}

TEST(Timeline, standsStillWhilePaused) {
  Timeline timeline({0}, 1.0, {0});
  timeline.pause({10});
  EXPECT_EQ(timeline.deadline({20}), SteadyTime::forever());
  EXPECT_EQ(timeline.position({1000}).ns, 10);
  timeline.resume({5000});
  EXPECT_EQ(timeline.deadline({20}), SteadyTime{5010});
  timeline.resume({6000});
  EXPECT_EQ(timeline.deadline({20}), SteadyTime{5010}) << "it ran already";
}

TEST(Timeline, standsAtALimitAndGoesOnFromThere) {
  Timeline timeline({0}, 1.0, {0});
  timeline.setLimit(Stamp{100}, {10});
  EXPECT_EQ(timeline.deadline({100}), SteadyTime{100}) << "comes to its limit";
  EXPECT_EQ(timeline.deadline({101}), SteadyTime::forever());
  EXPECT_FALSE(timeline.isHeld({99}));
  EXPECT_TRUE(timeline.isHeld({100}));
  EXPECT_EQ(timeline.position({500}).ns, 100);
  timeline.setLimit(Stamp{150}, {500});
  EXPECT_EQ(timeline.deadline({150}), SteadyTime{550});
  EXPECT_FALSE(timeline.isHeld({500}));
  timeline.setLimit(std::nullopt, {540});
  EXPECT_EQ(timeline.deadline({200}), SteadyTime{600}) << "it did not stand: nothing moves";
  timeline.setLimit(Stamp{10}, {560});
  EXPECT_EQ(timeline.position({700}).ns, 160) << "never back";
}

TEST(Timeline, keepsItsLimitOverPausesAndRates) {
  Timeline timeline({0}, 1.0, {0});
  timeline.setLimit(Stamp{100}, {0});
  timeline.pause({300});
  EXPECT_FALSE(timeline.isHeld({400})) << "paused, not held";
  timeline.resume({400});
  EXPECT_TRUE(timeline.isHeld({400}));
  timeline.setRate(2, {450});
  EXPECT_EQ(timeline.position({500}).ns, 100);
  timeline.setLimit(std::nullopt, {500});
  EXPECT_EQ(timeline.deadline({120}), SteadyTime{510});
}

TEST(Timeline, refusesARateThatIsNone) {
  EXPECT_THROW(Timeline({0}, 0.0, {0}), std::logic_error);
  EXPECT_THROW(Timeline({0}, -1.0, {0}), std::logic_error);
}

TEST(SteadyClock, sleepsUntilTheDeadlineAndNotLess) {
  SteadyClock clock;
  const SteadyTime deadline = clock.now().after(2'000'000);
  EXPECT_TRUE(clock.sleepUntil(deadline));
  EXPECT_TRUE(deadline <= clock.now());
  EXPECT_TRUE(clock.sleepUntil(deadline)) << "a deadline in the past is there at once";
}

TEST(SteadyClock, isWokenFromAnotherThread) {
  SteadyClock clock;
  std::thread waker([&clock] { clock.wake(); });
  EXPECT_FALSE(clock.sleepUntil(SteadyTime::forever()));
  waker.join();
  EXPECT_TRUE(clock.sleepUntil(clock.now())) << "one wake, one early return";
}

TEST(Lateness, tellsQuantilesMaximumAndDrift) {
  Lateness lateness;
  for (int i = 0; i < 990; ++i) lateness.add(1000);
  for (int i = 0; i < 10; ++i) lateness.add(1'000'000);
  EXPECT_EQ(lateness.count(), 1000u);
  EXPECT_NEAR(static_cast<double>(lateness.quantile(0.5)), 1000, 60);
  EXPECT_NEAR(static_cast<double>(lateness.quantile(0.99)), 1000, 60);
  EXPECT_NEAR(static_cast<double>(lateness.quantile(0.995)), 1e6, 6e4);
  EXPECT_EQ(lateness.max(), 1'000'000);
  EXPECT_NEAR(lateness.drift(), (10 * 1e6 + 54 * 1e3) / 64 - 1e3, 1);
  EXPECT_EQ(Lateness().quantile(0.5), 0);
}

// ------------------------------------------------------------------------------------------- lag

Stamp at(double seconds) { return {static_cast<std::int64_t>(seconds * 1e9)}; }

TEST(ConsumerLag, isBehindWhenTheLastAnswerIsTooFarBack) {
  ConsumerLag lag(1.0, at(10), true);
  lag.onPublished(at(11), at(500));
  EXPECT_FALSE(lag.isBehind()) << "as far as the begin counts as answered";
  lag.onPublished(at(11.1), at(501));
  EXPECT_TRUE(lag.isBehind());
  lag.onAnswer(at(10.05));
  EXPECT_TRUE(lag.isBehind());
  lag.onAnswer(at(10.2));
  EXPECT_FALSE(lag.isBehind());
}

TEST(ConsumerLag, looksUpStampsAcrossPausesAndSeeks) {
  ConsumerLag lag(1.0, at(0), false);
  lag.onPublished(at(0), at(100));
  lag.onPublished(at(1), at(101));
  lag.onPublished(at(1.5), at(111.5));  // after a pause of 10 s
  EXPECT_TRUE(lag.isBehind());
  lag.onAnswer(at(100.4));
  EXPECT_TRUE(lag.isBehind());
  lag.onAnswer(at(100.6));
  EXPECT_FALSE(lag.isBehind());
  lag.onAnswer(at(111.4));  // a header 0.1 s older than its message
  lag.onPublished(at(2.35), at(112.35));
  EXPECT_FALSE(lag.isBehind());
  lag.onPublished(at(2.45), at(112.45));
  EXPECT_TRUE(lag.isBehind());
  lag.onPublished(at(30), at(112.5));
  lag.onAnswer(at(112.3));
  EXPECT_TRUE(lag.isBehind()) << "that was before the seek";
  lag.onAnswer(at(112.46));
  EXPECT_FALSE(lag.isBehind());
  lag.onPublished(at(5), at(113));
  EXPECT_FALSE(lag.isBehind()) << "what is played again is not answered for yet";
  lag.onPublished(at(7), at(115));
  lag.onAnswer(at(200));
  EXPECT_FALSE(lag.isBehind()) << "stamped when it was done";
}

}  // namespace
}  // namespace afterglow::replay::timeline_test

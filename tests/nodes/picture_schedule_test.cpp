#include "nodes/projector/picture_schedule.hpp"

#include <gtest/gtest.h>

namespace afterglow::nodes::picture_schedule_test {
namespace {

using std::chrono::hours;
using std::chrono::steady_clock;

constexpr double kSlow_hz = 1.0 / 36'000;  // what waits for a period of it never returns

TEST(PictureSchedule, isDueAtOnceForNewContent) {
  PictureSchedule schedule(kSlow_hz);
  schedule.announce();
  schedule.awaitDue(steady_clock::now(), false);
  EXPECT_FALSE(schedule.isStopped());
}

TEST(PictureSchedule, isDueOneCalmPeriodAfterTheLastPicture) {
  PictureSchedule schedule(kSlow_hz);
  schedule.awaitDue(steady_clock::now() - hours(10), false);
  schedule.awaitDue(steady_clock::now() - hours(5), true);  // sooner, for what waits
}

TEST(PictureSchedule, waitsForNothingOnceItIsStopped) {
  PictureSchedule schedule(kSlow_hz);
  schedule.announce();
  schedule.awaitDue(steady_clock::now(), false);
  schedule.announce();
  schedule.stop();
  schedule.awaitDue(steady_clock::now(), false);
  EXPECT_TRUE(schedule.isStopped());
}

}  // namespace
}  // namespace afterglow::nodes::picture_schedule_test

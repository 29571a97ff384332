#include "nodes/projector/picture_schedule.hpp"

#include <gtest/gtest.h>

namespace afterglow::nodes::even_pace_test {
namespace {

using std::chrono::milliseconds;

TEST(EvenPace, isThePeriodWhileThereIsTime) {
  EvenPace pace(milliseconds(33));
  EXPECT_EQ(pace.interval(), milliseconds(33));
  for (int i = 0; i < 20; ++i) pace.add(milliseconds(20));
  EXPECT_EQ(pace.interval(), milliseconds(33));
}

TEST(EvenPace, isNotChangedByOneSlowPicture) {
  EvenPace pace(milliseconds(33));
  for (int i = 0; i < 8; ++i) pace.add(milliseconds(20));
  pace.add(milliseconds(90));
  EXPECT_EQ(pace.interval(), milliseconds(33));
}

TEST(EvenPace, isThatOfTheSlowestWhileMostAreTooSlow) {
  EvenPace pace(milliseconds(33));
  for (int i = 0; i < 20; ++i) pace.add(milliseconds(i % 2 == 0 ? 40 : 52));
  EXPECT_EQ(pace.interval(), milliseconds(52));
}

TEST(EvenPace, knowsWhatPicturesUsuallyTake) {
  EvenPace pace(milliseconds(33));
  for (int i = 0; i < 8; ++i) pace.add(milliseconds(20));
  pace.add(milliseconds(90));
  EXPECT_EQ(pace.usual(), milliseconds(20));
}

TEST(EvenPace, isThePeriodAgainSoonAfterTheLoadHasGone) {
  EvenPace pace(milliseconds(33));
  for (int i = 0; i < 20; ++i) pace.add(milliseconds(50));
  for (int i = 0; i < 5; ++i) pace.add(milliseconds(10));
  EXPECT_EQ(pace.interval(), milliseconds(33));
}

}  // namespace
}  // namespace afterglow::nodes::even_pace_test

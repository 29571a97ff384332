#include "replay/motion/base/drive_timing.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace afterglow::replay::path_time_test {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

Stamp s(double seconds) { return {static_cast<std::int64_t>(seconds * kSecond)}; }

TEST(PathTime, runsAtItsPaceToTheEndAndNoFurther) {
  PathTime path(s(10), s(12), 2);
  path.advance(0.5);
  EXPECT_EQ(path.now(), s(11));
  path.setPace(0.5);
  path.advance(0.5);
  EXPECT_EQ(path.now(), s(11.25));
  path.setRate(4);
  EXPECT_DOUBLE_EQ(path.pace(), 1) << "the pace changes with the rate";
  path.advance(10);
  EXPECT_EQ(path.now(), s(12));
  EXPECT_TRUE(path.isAtEnd());
}

TEST(PathTime, doesNotPassItsLimitNorGoBackForOne) {
  PathTime path(s(0), s(10), 1);
  path.setLimit(s(1));
  path.advance(3);
  EXPECT_EQ(path.now(), s(1));
  path.setLimit(s(0));
  path.advance(3);
  EXPECT_EQ(path.now(), s(1));
}

TEST(PathTime, catchesUpWithTheTimelineALittleFasterAndStaysBehindIt) {
  PathTime path(s(0), s(10), 1);
  path.meet(s(2));
  path.advance(1);
  EXPECT_EQ(path.now(), s(1.05));
  path.meet(s(2.06));
  path.advance(1);
  EXPECT_EQ(path.now(), s(2.06));
}

TEST(PathTime, refusesARateThatIsNotAboveZero) {
  EXPECT_THROW(PathTime(s(0), s(1), 0), std::invalid_argument);
  PathTime path(s(0), s(1), 1);
  EXPECT_THROW(path.setRate(-1), std::invalid_argument);
}

}  // namespace
}  // namespace afterglow::replay::path_time_test

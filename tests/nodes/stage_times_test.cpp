#include "nodes/projector/stage_times.hpp"

#include <gtest/gtest.h>

namespace afterglow::nodes::stage_times_test {
namespace {

using std::chrono::milliseconds;
using Words = std::vector<std::pair<std::string, std::string>>;

TEST(StageTimes, areTheMedianAndTheWorstButOneInAHundredOfEachStage) {
  StageTimes times;
  for (int ms = 100; ms >= 1; --ms) times.add(Stage::Drawn, milliseconds(ms));
  times.add(Stage::Arrived, milliseconds(7));
  EXPECT_EQ(times.words(), (Words{{"arrived", "p50 7.0, p99 7.0 ms"},
                                  {"drawn", "p50 50.0, p99 99.0 ms"}}));
}

TEST(StageTimes, forgetTheOldest) {
  StageTimes times;
  for (int i = 0; i < 10; ++i) times.add(Stage::Published, milliseconds(900));
  for (std::size_t i = 0; i < StageTimes::kKept; ++i) times.add(Stage::Published, milliseconds(2));
  EXPECT_EQ(times.words(), (Words{{"published", "p50 2.0, p99 2.0 ms"}}));
}

TEST(StageTimes, ofNothingAreNotTold) { EXPECT_TRUE(StageTimes().words().empty()); }

}  // namespace
}  // namespace afterglow::nodes::stage_times_test

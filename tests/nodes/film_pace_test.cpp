#include "nodes/observer/film.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace afterglow::nodes::film_pace_test {
namespace {

TEST(ClockPair, interpolatesBetweenMomentsAndRunsAlikeAroundThem) {
  ClockPair clocks;
  EXPECT_EQ(clocks.secondAt(3), 3);
  for (const auto& [first, second] : {std::pair{2., 0.}, {4., 1.}, {6., 1.}, {7., 2.}}) {
    clocks.add(first, second);
  }
  EXPECT_DOUBLE_EQ(clocks.secondAt(1), -1);
  EXPECT_DOUBLE_EQ(clocks.secondAt(3), 0.5);
  EXPECT_DOUBLE_EQ(clocks.secondAt(5), 1) << "it stands";
  EXPECT_DOUBLE_EQ(clocks.secondAt(6.5), 1.5);
  EXPECT_DOUBLE_EQ(clocks.secondAt(9), 4);
  EXPECT_DOUBLE_EQ(clocks.firstAt(0.5), 3);
  EXPECT_DOUBLE_EQ(clocks.firstAt(1), 4);
}

TEST(FilmPace, isTheRecordingsOwnWhereThereIsTimeEnough) {
  for (const double most : {12.0, static_cast<double>(INFINITY)}) {
    const ClockPair clocks = filmPace({10, {{2, 4}}, {{0, 10}}}, most);
    for (const double s : {0., 1., 3., 9.9, 10.}) EXPECT_NEAR(clocks.secondAt(s), s, 1e-9);
  }
}

TEST(FilmPace, hastensThroughAllThatIsNotSaid) {
  const ClockPair clocks = filmPace({20, {{5, 6}, {12, 14}}, {{0, 20}}}, 12);
  EXPECT_NEAR(clocks.firstAt(20), 12, 1e-9);
  EXPECT_NEAR(clocks.firstAt(14) - clocks.firstAt(12), 2, 1e-9);
  EXPECT_NEAR(clocks.firstAt(6) - clocks.firstAt(5), 1, 1e-9);
  EXPECT_LT(clocks.firstAt(4), 2.5);
}

TEST(FilmPace, leavesOutWhatStandsStillButNotWhatIsSaidMeanwhile) {
  const ClockPair clocks = filmPace({30, {{20, 22}}, {{5, 7}, {28, 30}}}, 25);
  EXPECT_NEAR(clocks.firstAt(5), 0.7, 1e-9);
  EXPECT_NEAR(clocks.firstAt(7) - clocks.firstAt(5), 2, 1e-9);
  EXPECT_NEAR(clocks.firstAt(22) - clocks.firstAt(20), 2, 1e-9);
  EXPECT_NEAR(clocks.firstAt(30), 0.7 + 2 + 0.7 + 2.8 + 0.7 + 2, 1e-9);
}

TEST(FilmPace, isLongerThanWantedWhereTooMuchIsSaid) {
  EXPECT_NEAR(filmPace({10, {{0, 10}}, {{0, 10}}}, 3).firstAt(10), 10, 1e-9);
  EXPECT_NEAR(filmPace({40, {}, {{0, 40}}}, 1).firstAt(40), 10, 1e-9);
}

}  // namespace
}  // namespace afterglow::nodes::film_pace_test

// Where a trajectory is gone on with in its midst, sampled finely as controllers execute it.
#include "replay/motion/arm/arm_path.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "replay/messages/ranges.hpp"

namespace afterglow::replay::arm_path_test {
namespace {

using Numbers = std::vector<double>;

const Numbers kFrom = {0, 1.3, 1.4}, kTo = {0.05, 0.3, 0.4};
constexpr double kLength = 5, kStep = 0.002;  // s

/// As MoveIt sends it: 20 points with velocities and accelerations.
std::vector<ArmKnot> dense(bool has_accelerations) {
  std::vector<ArmKnot> knots;
  for (int k = 0; k < 20; ++k) {
    const double s = k / 19.;
    ArmKnot knot{s * kLength, {}, {}, {}};
    for (std::size_t i = 0; i < kFrom.size(); ++i) {
      const double way = kTo[i] - kFrom[i];
      knot.positions.push_back(kFrom[i] + way * s * s * s * (10 - 15 * s + 6 * s * s));
      knot.velocities.push_back(way * 30 * s * s * (1 - s) * (1 - s) / kLength);
      if (!has_accelerations) continue;
      knot.accelerations.push_back(way * 60 * s * (1 - s) * (1 - 2 * s) / (kLength * kLength));
    }
    knots.push_back(knot);
  }
  return knots;
}

std::vector<ArmKnot> lines() {
  return {{0, {0, 1.3, 1.4}, {}, {}},
          {1.5, {0.05, 1.0, 1.0}, {}, {}},
          {3, {0.1, 0.5, 0.7}, {}, {}},
          {5, {0.1, 0.6, 0.2}, {}, {}}};
}

/// Rest to rest in one piece.
std::vector<ArmKnot> single() {
  const Numbers still(kFrom.size());
  return {{0, kFrom, still, {}}, {kLength, kTo, still, {}}};
}

struct Moment {
  Numbers positions, velocities;
};

/// What Fetch's controllers command: Hermite by the basis polynomials.
Moment executed(const std::vector<ArmKnot>& knots, double seconds) {
  std::size_t k = 1;
  while (k + 1 < knots.size() && knots[k].at_s < seconds) ++k;
  const ArmKnot &a = knots[k - 1], &b = knots[k];
  const double T = b.at_s - a.at_s, x = std::clamp((seconds - a.at_s) / T, 0.0, 1.0);
  Moment moment;
  for (std::size_t i = 0; i < a.positions.size(); ++i) {
    const double p = a.positions[i], q = b.positions[i];
    if (a.velocities.empty()) {
      moment.positions.push_back(p + x * (q - p));
      moment.velocities.push_back((q - p) / T);
      continue;
    }
    const double v = a.velocities[i] * T, w = b.velocities[i] * T, x2 = x * x, x3 = x2 * x;
    if (a.accelerations.empty()) {
      moment.positions.push_back((2 * x3 - 3 * x2 + 1) * p + (x3 - 2 * x2 + x) * v +
                                 (3 * x2 - 2 * x3) * q + (x3 - x2) * w);
      moment.velocities.push_back(((6 * x2 - 6 * x) * p + (3 * x2 - 4 * x + 1) * v +
                                   (6 * x - 6 * x2) * q + (3 * x2 - 2 * x) * w) / T);
      continue;
    }
    const double c = a.accelerations[i] * T * T, d = b.accelerations[i] * T * T, x4 = x3 * x,
                 x5 = x4 * x;
    moment.positions.push_back((1 - 10 * x3 + 15 * x4 - 6 * x5) * p +
                               (x - 6 * x3 + 8 * x4 - 3 * x5) * v +
                               (x2 - 3 * x3 + 3 * x4 - x5) / 2 * c +
                               (10 * x3 - 15 * x4 + 6 * x5) * q +
                               (-4 * x3 + 7 * x4 - 3 * x5) * w + (x3 - 2 * x4 + x5) / 2 * d);
    moment.velocities.push_back(((-30 * x2 + 60 * x3 - 30 * x4) * (p - q) +
                                 (1 - 18 * x2 + 32 * x3 - 15 * x4) * v +
                                 (2 * x - 9 * x2 + 12 * x3 - 5 * x4) / 2 * c +
                                 (-12 * x2 + 28 * x3 - 15 * x4) * w +
                                 (3 * x2 - 8 * x3 + 5 * x4) / 2 * d) / T);
  }
  return moment;
}

std::vector<Moment> allOf(const std::vector<ArmKnot>& knots) {
  std::vector<Moment> moments;
  for (double t = knots.front().at_s; t <= knots.back().at_s; t += kStep) {
    moments.push_back(executed(knots, t));
  }
  return moments;
}

double peakOf(const std::vector<Moment>& moments) {
  double peak = 0;
  for (const Moment& moment : moments) {
    for (const double velocity : moment.velocities) peak = std::max(peak, std::abs(velocity));
  }
  return peak;
}

double distanceOf(const Numbers& a, const Numbers& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

/// What a controller leaves out that has only what all points have.
std::vector<ArmKnot> sent(const ArmPath& path, std::vector<ArmKnot> knots) {
  for (ArmKnot& knot : knots) {
    if (!path.hasVelocities()) knot.velocities.clear();
    if (!path.hasAccelerations()) knot.accelerations.clear();
  }
  return knots;
}

/// Forward along the recorded way, on it, and no faster than it.
void expectAlong(const std::vector<ArmKnot>& recorded, double from_s, double pace,
                 double ramp_s) {
  SCOPED_TRACE(from_s);
  const ArmPath path(recorded, std::vector<bool>(kFrom.size()));
  const auto knots = sent(path, depart(path, {from_s, {}, 0, pace, ramp_s}));
  const std::vector<Moment> then = allOf(recorded), now = allOf(knots);
  for (std::size_t k = 1; k < knots.size(); ++k) {
    EXPECT_GT(knots[k].at_s, knots[k - 1].at_s + 1e-6);
  }
  EXPECT_EQ(knots.front().at_s, 0);
  EXPECT_LT(distanceOf(knots.front().positions, path.at(from_s).positions), 1e-9);
  EXPECT_LT(distanceOf(knots.back().positions, recorded.back().positions), 1e-9);
  EXPECT_LE(peakOf(now), peakOf(then) * 1.002);
  auto place = static_cast<std::size_t>(from_s / kStep);
  double farthest = 0;
  for (const Moment& moment : now) {
    // The nearest place a little ahead: a way back would take the joints away from all of them.
    double nearest = std::numeric_limits<double>::max();
    std::size_t best = place;
    for (std::size_t k = place; k < std::min(place + 20, then.size()); ++k) {
      const double off = distanceOf(moment.positions, then[k].positions);
      if (off < nearest) best = k;
      nearest = std::min(nearest, off);
    }
    place = best;
    farthest = std::max(farthest, nearest);
  }
  EXPECT_LT(farthest, 0.002);
  if (pace == 0) {
    EXPECT_LT(distanceOf(now[1].positions, now[0].positions), 2e-4) << "from rest";
  }
}

struct Trajectories : testing::TestWithParam<int> {
  static std::vector<ArmKnot> knots() {
    const int kind = GetParam();
    return kind == 0 ? dense(true) : kind == 1 ? dense(false) : kind == 2 ? lines() : single();
  }
};

TEST_P(Trajectories, areGoneOnWithFromAnywhereForwardOnThePathAndNoFaster) {
  for (double from = 0.02; from < kLength; from += 0.37) expectAlong(knots(), from, 0, 0.5);
  for (double from = 0.02; from < kLength - 0.5; from += 0.37) expectAlong(knots(), from, 0, 2);
}

TEST_P(Trajectories, areGoneOnWithFromMotionWithoutAHalt) {
  for (double from = 0.3; from < kLength - 1; from += 0.37) expectAlong(knots(), from, 0.5, 0.4);
}

TEST_P(Trajectories, arePassedAtTheSameTimesOnceTheArmIsAsFastAsThey) {
  const ArmPath path(knots(), std::vector<bool>(kFrom.size()));
  const ArmDeparture departure{2, {}, 0, 0, 0.5};
  EXPECT_DOUBLE_EQ(departure.lostSeconds(), 0.25);
  const auto rest = sent(path, depart(path, departure));
  for (double t = 0.5; t < 3.25; t += 0.01) {
    EXPECT_LT(distanceOf(executed(rest, t).positions, executed(knots(), 2 - 0.25 + t).positions),
              1e-6)
        << t;
  }
  for (const ArmKnot& own : path.knots()) {
    if (own.at_s < 2.3 || !path.hasVelocities()) continue;
    EXPECT_TRUE(anyOf(rest,
                      [&](const ArmKnot& knot) {
                        return own.positions == knot.positions && own.velocities == knot.velocities;
                      }))
        << "to the last bit, " << own.at_s;
  }
}

TEST_P(Trajectories, areFollowedAtOnceByAnArmThatIsAsFastAsThey) {
  const ArmPath path(knots(), std::vector<bool>(kFrom.size()));
  for (const ArmKnot& knot : depart(path, {2, {}, 0, 1, 0})) {
    const ArmKnot there = path.at(2 + knot.at_s);
    for (std::size_t i = 0; i < kFrom.size(); ++i) {
      EXPECT_NEAR(knot.positions[i], there.positions[i], 1e-9);
      EXPECT_TRUE(std::isfinite(knot.velocities[i]) && std::isfinite(knot.accelerations[i]));
    }
  }
}

TEST_P(Trajectories, areGotOntoGentlyByAnArmThatIsALittleOff) {
  const ArmPath path(knots(), std::vector<bool>(kFrom.size()));
  const Numbers offsets = {0.01, 0.04, -0.04};
  const auto rest = sent(path, depart(path, {1.2, offsets, 0.75, 0, 1.25}));
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    EXPECT_NEAR(rest.front().positions[i], path.at(1.2).positions[i] + offsets[i], 1e-9);
  }
  EXPECT_LE(peakOf(allOf(rest)), peakOf(allOf(knots())) * 1.01);
  EXPECT_LT(distanceOf(rest.back().positions, knots().back().positions), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Kinds, Trajectories, testing::Values(0, 1, 2, 3));

/// By Simpson's rule, over two steps of the ramp at a time.
TEST(ArmDeparture, hasTheVelocitiesAndAccelerationsOfItsPositions) {
  const Numbers still(kFrom.size()), offsets = {0.1, 0.3, -0.4};
  const ArmPath path({{0, kFrom, still, still}, {kLength, kTo, still, still}},
                     std::vector<bool>(kFrom.size()));
  for (const auto& [pace, blend_s, ramp_s] :
       {std::tuple(0.0, 0.8, 1.2), {0.4, 1.6, 0.4}, {1.3, 1.0, 1.0}, {0.7, 0.8, 2.0}}) {
    const auto knots = depart(path, {1.2, offsets, blend_s, pace, ramp_s});
    ASSERT_GT(knots.size(), 10u);
    for (std::size_t k = 0; k + 3 < knots.size(); k += 2) {
      const ArmKnot &a = knots[k], &b = knots[k + 1], &c = knots[k + 2];
      const double third = (c.at_s - a.at_s) / 6;
      for (std::size_t i = 0; i < kFrom.size(); ++i) {
        EXPECT_NEAR(c.positions[i] - a.positions[i],
                    third * (a.velocities[i] + 4 * b.velocities[i] + c.velocities[i]), 2e-5);
        EXPECT_NEAR(c.velocities[i] - a.velocities[i],
                    third * (a.accelerations[i] + 4 * b.accelerations[i] + c.accelerations[i]),
                    2e-4)
            << pace << " " << a.at_s;
      }
    }
  }
}

TEST(ArmPath, findsThePlaceAlsoOfAnArmThatIsLate) {
  const ArmPath path(lines(), {false, false, false});
  const Numbers tolerances(3, 0.05);
  EXPECT_NEAR(path.find(path.at(2).positions, tolerances, 2).value(), 2, 0.011);
  EXPECT_NEAR(path.find(path.at(1).positions, tolerances, 3.5).value(), 1, 0.011);
  EXPECT_FALSE(path.find(path.at(4).positions, tolerances, 1)) << "it has not been there yet";
  EXPECT_FALSE(path.find({0.5, 1, 1}, tolerances, 1));
}

TEST(ArmPath, standsBeforeItsBeginAndAfterItsEndAndEndsAsFastAsItWas) {
  const ArmPath path({{1, {0.5}, {0.2}, {}}, {2, {1}, {0.4}, {}}}, {false});
  for (const double seconds : {0.5, 2.5}) {
    EXPECT_EQ(path.at(seconds).positions, Numbers{seconds < 1 ? 0.5 : 1.0});
    EXPECT_EQ(path.at(seconds).velocities, Numbers{0});
  }
  EXPECT_NEAR(path.at(2).velocities[0], 0.4, 1e-9) << "its last moment";
}

/// A joint that turns by a radian a second, beside one that stands.
TEST(ArmPath, isSearchedTenSecondsBackAndHalfASecondAhead) {
  const ArmPath path({{0, {0, 0}, {}, {}}, {30, {30, 0}, {}, {}}}, {false, false});
  const Numbers tolerances(2, 0.05);
  const auto find = [&](double around_s) { return path.find({15, 0.045}, tolerances, around_s); };
  EXPECT_NEAR(find(24.9).value(), 15, 0.051) << "a joint may be off by almost its tolerance";
  EXPECT_FALSE(find(25.1));
  EXPECT_NEAR(find(14.6).value(), 15, 0.051);
  EXPECT_FALSE(find(14.4));
  EXPECT_NEAR(path.find({30, 0}, tolerances, 38).value(), 30, 0.051) << "no later than its end";
  const ArmPath point({{0, {1}, {}, {}}}, {false});
  EXPECT_EQ(point.find({1}, {0.05}, 0), 0.0);
}

TEST(ArmPath, takesTheMomentThatIsMeantOfAStand) {
  const ArmPath path({{0, {0}, {}, {}}, {1, {1}, {}, {}}, {4, {1}, {}, {}}, {5, {0}, {}, {}}},
                     {false});
  EXPECT_NEAR(path.find({1.0}, {0.05}, 2.5).value(), 2.5, 0.011);
  EXPECT_NEAR(path.find({0.5}, {0.05}, 4.4).value(), 4.5, 0.011) << "on its way back";
}

TEST(ArmPath, goesTheShortWayRoundOfAJointWithoutAnEnd) {
  const ArmPath path({{0, {3.1}, {}, {}}, {1, {-3.1}, {}, {}}}, {true});
  EXPECT_NEAR(path.at(0.5).positions[0], 3.14159265, 1e-6);
  EXPECT_TRUE(path.find({-3.12}, {0.05}, 0.5));
}

TEST(ArmPath, settlesOnAnEndThatIsReached) {
  const ArmPath path(single(), {false, false, false});
  const auto rest = depart(path, {kLength, {0.01, 0, 0}, 0.9, 0, 1.5});
  ASSERT_EQ(rest.size(), 2u);
  EXPECT_NEAR(rest[0].positions[0], kTo[0] + 0.01, 1e-9);
  EXPECT_EQ(rest[1].positions, kTo);
  EXPECT_NEAR(rest[1].at_s, 0.9, 1e-9) << "as long as the offset takes";
  EXPECT_LT(depart(path, {kLength, {0.01, 0, 0}, 0.1, 0, 1.5})[1].at_s, 0.9);
  EXPECT_NEAR(depart(path, {kLength + 1, {}, 0, 0, 0})[1].at_s, 0.2, 1e-9) << "at the least";
}

}  // namespace
}  // namespace afterglow::replay::arm_path_test

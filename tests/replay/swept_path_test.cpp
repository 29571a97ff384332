// The floor that a base sweeps, and what a scan says of it.
#include "replay/motion/base/floor.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/simulated_scan.hpp"

namespace afterglow::replay::swept_path_test {
namespace {

using namespace test;

const Footprint kRound = Footprint::circle(0.3);
const Footprint kOblong = Footprint::polygon({{0.5, 0.2}, {-0.5, 0.2}, {-0.5, -0.2}, {0.5, -0.2}});
constexpr double kClearance = 0.15, kFar = 3;

double freeOf(const PlanarVelocity& velocity, const FloorPoint& obstacle,
              const Footprint& footprint = kRound) {
  const SweptPath path = pathOf(velocity, footprint.radius(), kFar);
  return freeWay(path, footprint, kClearance, {obstacle}).way;
}

TEST(Footprint, isAsFarAsItsNearestEdge) {
  EXPECT_NEAR(kRound.distanceTo({1, 0}), 0.7, 1e-9);
  EXPECT_NEAR(kOblong.distanceTo({1, 0}), 0.5, 1e-9);
  EXPECT_NEAR(kOblong.distanceTo({0.8, 0.6}), 0.5, 1e-9);
  EXPECT_NEAR(kOblong.distanceTo({0, 0}), -0.2, 1e-9);
  EXPECT_NEAR(kOblong.radius(), std::hypot(0.5, 0.2), 1e-9);
}

TEST(Footprint, isReadAsARadiusOrAsCorners) {
  EXPECT_NEAR(parseFootprint("0.25").radius(), 0.25, 1e-9);
  // In any order: the hull counts.
  const Footprint read = parseFootprint("0.5,0.2 -0.5,-0.2 0.5,-0.2 -0.5,0.2 0.1,0.1");
  EXPECT_NEAR(read.distanceTo({1, 0}), 0.5, 1e-9);
  for (const char* text : {"", "round", "0", "-1", "0.1,0.2", "0,0 1,1 2,2", "0.3 0.3", "9", "nan",
                           "0;0 0;1 1;0", "0,0 0,1 1,", "0,0 0,1 1,0x", "0,0 0,1 0.3"}) {
    EXPECT_THROW(parseFootprint(text), std::invalid_argument) << text;
  }
}

TEST(Footprint, liesWithinFiveMetersAndSpansAnArea) {
  const auto refusal = [](const std::vector<std::array<double, 2>>& corners) -> std::string {
    try {
      Footprint::polygon(corners);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal({{0, 0}, {5, 0}, {0, 5}}), "");
  const std::string far = "a footprint's corners lie within 5 m";
  EXPECT_EQ(refusal({{0, 0}, {5.01, 0}, {0, 5}}), far);
  EXPECT_EQ(refusal({{0, 0}, {std::nan(""), 0}, {0, 5}}), far);
  const std::string flat = "a footprint's corners have to span an area";
  EXPECT_EQ(refusal({{0, 0}, {1, 0}}), flat);
  EXPECT_EQ(refusal({{0, 0}, {1, 0}, {0.5, 1.9e-4}}), flat) << "less than a square centimeter";
  EXPECT_EQ(refusal({{0, 0}, {1, 0}, {0.5, 2.1e-4}}), "");
  EXPECT_EQ(refusal({{0, 0}, {0, 0}, {0, 0}}), flat);
  EXPECT_EQ(refusal({}), flat);
}

TEST(Footprint, hasAnOutlineOfPointsOnItsEdge) {
  for (const Footprint& footprint :
       {kRound, kOblong, Footprint::circle(0.05), Footprint::circle(5)}) {
    const std::vector<FloorPoint> outline = footprint.outline();
    EXPECT_GE(outline.size(), 16u);
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const FloorPoint &a = outline[i], &b = outline[(i + 1) % outline.size()];
      EXPECT_NEAR(footprint.distanceTo(a), 0, 1e-9);
      EXPECT_LE(std::hypot(b.x - a.x, b.y - a.y), 0.1 + 1e-9);
    }
  }
}

TEST(SweptPath, isFreeUpToWhatStandsOnAStraightWay) {
  EXPECT_NEAR(freeOf({0.5, 0}, {1.5, 0}), 1.5 - 0.3 - kClearance, 0.03);
  EXPECT_NEAR(freeOf({0.5, 0}, {1.5, 0.4}), 1.5 - std::sqrt(0.45 * 0.45 - 0.4 * 0.4), 0.03);
  EXPECT_TRUE(std::isinf(freeOf({0.5, 0}, {1.5, 0.46}))) << "it passes";
  EXPECT_TRUE(std::isinf(freeOf({0.5, 0}, {-0.6, 0}))) << "it drives away";
  EXPECT_NEAR(freeOf({0.01, 0}, {1.5, 0}), freeOf({0.5, 0}, {1.5, 0}), 1e-9) << "however slowly";
}

TEST(SweptPath, leadsBackward) {
  EXPECT_NEAR(freeOf({-0.5, 0}, {-1.5, 0}), 1.5 - 0.3 - kClearance, 0.03);
  EXPECT_TRUE(std::isinf(freeOf({-0.5, 0}, {1.5, 0})));
}

TEST(SweptPath, leadsRoundABend) {
  // A circle of 1 m about (0, 1): a quarter of it leads to (1, 1).
  const double quarter = kPi / 2 * (1 + 0.3);  // its rim goes farther than its middle
  EXPECT_NEAR(freeOf({0.5, 0.5}, {1, 1}), quarter - (0.3 + kClearance) * 1.3, 0.06);
  EXPECT_TRUE(std::isinf(freeOf({0.5, 0.5}, {1.5, 0}))) << "straight on";
}

TEST(SweptPath, ofTurningOnTheSpotIsWhatTheCornersSweep) {
  EXPECT_TRUE(std::isinf(freeOf({0, 0.5}, {0, 0.46}))) << "a round base sweeps nothing";
  const FloorPoint beside{0, 0.55};  // the long side passes, the corners do not
  EXPECT_FALSE(std::isinf(freeOf({0, 0.5}, beside, kOblong)));
  EXPECT_TRUE(std::isinf(freeOf({0.5, 0}, beside, kOblong)));
}

TEST(SweptPath, goesSidewaysWithAHolonomicBase) {
  const SweptPath path = pathOf({0, 0, 0.5}, 0.3, kFar);
  EXPECT_NEAR(freeWay(path, kRound, kClearance, {{0, 1.5}}).way, 1.05, 0.03);
  EXPECT_NEAR(path.back().T_base_then.yaw, 0, 1e-9);
}

TEST(SweptPath, followsTheTrackAheadAndNotTheWayBehind) {
  std::vector<PoseTrack::Sample> samples;  // 1 m ahead in 2 s, and 1 m to the left
  for (int i = 0; i <= 20; ++i) samples.push_back({stampAt(0.1 * i), {0.05 * i, 0, 0}});
  for (int i = 1; i <= 10; ++i) samples.push_back({stampAt(2 + 0.1 * i), {1, 0, kPi / 20 * i}});
  for (int i = 1; i <= 20; ++i) samples.push_back({stampAt(3 + 0.1 * i), {1, 0.05 * i, kPi / 2}});
  const PoseTrack track(samples, "map", true);
  const auto free = [&](double from, const PlanarPose& base, const FloorPoint& obstacle) {
    const PlanarPose seen = between(base, {obstacle.x, obstacle.y, 0});
    const SweptPath path = pathAlong(track, stampAt(from), base, 0.3, 5);
    return freeWay(path, kRound, kClearance, {{seen.x, seen.y}}).way;
  };
  EXPECT_NEAR(free(0, {0, 0, 0}, {1, 1.2}), 1 + 0.3 * kPi / 2 + 0.75, 0.06);
  EXPECT_TRUE(std::isinf(free(0, {0, 0, 0}, {1.6, 0}))) << "it turns before that";
  EXPECT_TRUE(std::isinf(free(1.6, {0.8, 0, 0}, {0, 0.2}))) << "that lies behind";
  EXPECT_NEAR(free(1, {0.5, 0, 0}, {1, 1.2}) - free(1, {0.4, 0, 0}, {1, 1.2}), -0.1, 0.03)
      << "a base that lags behind has farther to go";
}

TEST(SweptPath, isLongerByWhatABaseLagsBehindInWhicheverDirection) {
  const PlanarPose velocity{0.3, 0.4, 0};  // m/s, which is no way that it looks
  std::vector<PoseTrack::Sample> samples;
  for (int i = 0; i <= 40; ++i) {
    samples.push_back({stampAt(0.1 * i), {0.1 * i * velocity.x, 0.1 * i * velocity.y, 0}});
  }
  const PoseTrack track(samples, "map", true);
  const auto free = [&](double behind) {
    const PlanarPose base{0.3 - 0.6 * behind, 0.4 - 0.8 * behind, 0};
    const SweptPath path = pathAlong(track, stampAt(1), base, 0.3, 5, true);
    return freeWay(path, kRound, kClearance, {{1.2 - base.x, 1.6 - base.y}}).way;
  };
  EXPECT_NEAR(free(0), 1.5 - 0.45, 0.03);
  EXPECT_NEAR(free(0.2), 1.7 - 0.45, 0.03);
}

TEST(SweptPath, mayLeaveWhatIsNearButNotComeNearer) {
  const FloorPoint table{0.37, 0};  // 7 cm ahead of the base
  EXPECT_EQ(freeOf({0.2, 0}, table), 0);
  EXPECT_TRUE(std::isinf(freeOf({-0.2, 0}, table)));
  EXPECT_TRUE(std::isinf(freeOf({0, 1}, table)));
}

TEST(FloorScan, hasNoPointsWhereNothingWasMeasured) {
  RangeScan ranges;
  ranges.angle_min = -0.2;
  ranges.angle_increment = 0.1;
  ranges.range_min = 0.1;
  ranges.range_max = 10;
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  ranges.ranges = {nan, inf, 0.05f, 2, 12};
  const FloorScan scan(ranges, {}, nullptr, {});
  ASSERT_EQ(scan.points().size(), 1u);
  EXPECT_NEAR(scan.points()[0].at.x, 2 * std::cos(0.1), 1e-6);
  EXPECT_FALSE(scan.isBlind());
  ranges.range_min = ranges.range_max = 2;
  EXPECT_EQ(FloorScan(ranges, {}, nullptr, {}).points().size(), 1u) << "at both limits";
  ranges.range_min = 0.1;
  ranges.range_max = 10;
  ranges.ranges = {nan, inf, 0.05f, nan, 12};
  EXPECT_TRUE(FloorScan(ranges, {}, nullptr, {}).isBlind());
}

TEST(FloorScan, isRefusedWhereItsAnglesOrLimitsAreNoNumbers) {
  RangeScan whole;
  whole.angle_increment = 0.1;
  whole.range_max = 10;
  whole.ranges = {1};
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  EXPECT_NO_THROW(FloorScan(whole, {}, nullptr, {}));
  whole.range_max = inf;
  EXPECT_NO_THROW(FloorScan(whole, {}, nullptr, {})) << "as far as it sees";
  const auto refused = [&](double RangeScan::*member, double number) {
    RangeScan scan = whole;
    scan.*member = number;
    EXPECT_THROW(FloorScan(scan, {}, nullptr, {}), std::invalid_argument) << number;
  };
  refused(&RangeScan::angle_min, nan);
  refused(&RangeScan::angle_min, inf);
  for (const double increment : {nan, inf, 0.}) refused(&RangeScan::angle_increment, increment);
  refused(&RangeScan::range_min, nan);
  refused(&RangeScan::range_max, nan);
}

/// As of a joint whose link has no length.
TEST(FloorScan, leavesOutARobotsPartThatIsAPoint) {
  const RangeScan ranges = rangesOf({{0.6, 0, 0.05}}, {}, 0);
  const ScanMount mount{{kLaserAhead, 0}, {1, 0}, {0, 1}};
  const auto pointsThere = [&](const std::vector<OwnPart>& parts) {
    int count = 0;
    const FloorScan scan(ranges, mount, nullptr, parts);
    for (const FloorScan::Point& point : scan.points()) {
      count += std::hypot(point.at.x - 0.6, point.at.y) < 0.1;
    }
    return count;
  };
  EXPECT_GT(pointsThere({}), 0);
  EXPECT_EQ(pointsThere({{{0.6, 0}, {0.6, 0}, 0.1}}), 0);
}

TEST(FloorScan, seesWhatAFetchSeesAndNothingBehind) {
  const auto scan = scanOf({}, {}, 0);
  EXPECT_TRUE(scan->sees({2, 0}) && scan->sees({1, 1.5}) && scan->sees({0.1, -1}));
  EXPECT_FALSE(scan->sees({-1, 0}));
  EXPECT_FALSE(scan->sees({-1, 1}));
  const auto ahead = pathOf({0.5, 0}, 0.3, 1), back = pathOf({-0.5, 0}, 0.3, 1),
             turn = pathOf({0, 0.5}, 0.3, 1), bend = pathOf({0.5, 0.5}, 0.3, 1);
  EXPECT_TRUE(isSeen(ahead, kRound, *scan) && isSeen(turn, kRound, *scan));
  EXPECT_TRUE(isSeen(bend, kRound, *scan));
  EXPECT_TRUE(isSeen(pathOf({0.5, 0.5}, 0.3, 6), kRound, *scan)) << "what comes next counts";
  EXPECT_TRUE(isSeen(pathOf({0.5, 0}, 0.3, 0.1), kRound, *scan)) << "as far as it leads";
  EXPECT_FALSE(isSeen(pathOf({-0.5, 0}, 0.3, 0.1), kRound, *scan));
  EXPECT_FALSE(isSeen(back, kRound, *scan));
}

TEST(FloorScan, leavesOutTheRobotsOwnPartsAndDoesNotSeeBehindThem) {
  // An arm that hangs down ahead of the base, and somebody farther on.
  RangeScan ranges = rangesOf({{0.6, 0, 0.05}, {2, 1, 0.1}}, {}, 0);
  const ScanMount mount{{kLaserAhead, 0}, {1, 0}, {0, 1}};
  const OwnPart arm{{0.4, 0}, {0.65, 0}, 0.12};
  const FloorScan scan(ranges, mount, &kRound, {arm});
  EXPECT_FALSE(scan.sees({2, 0}));
  EXPECT_TRUE(scan.sees({2, 1}));
  std::vector<FloorPoint> points;
  for (const FloorScan::Point& point : scan.points()) points.push_back(point.at);
  EXPECT_TRUE(std::isinf(freeWay(pathOf({0.3, 0}, 0.3, 1), kRound, kClearance, points).way));
}

/// Ten beams, 0.1 rad apart from angle 0 on, at what was measured by each, m.
FloorScan beams(const std::vector<float>& ranges, const ScanMount& mount = {}) {
  RangeScan scan;
  scan.angle_increment = 0.1;
  scan.range_max = 10;
  scan.ranges = ranges;
  return {scan, mount, nullptr, {}};
}

FloorPoint toward(double angle, double range = 1) {
  return {range * std::cos(angle), range * std::sin(angle)};
}

TEST(FloorScan, seesByTheBeamsNextToADirectionAndByNoOthers) {
  const float nan = std::nanf("");
  const FloorScan scan = beams({nan, nan, nan, 2, nan, nan, nan});
  for (const double angle : {0.2, 0.3, 0.4}) EXPECT_TRUE(scan.sees(toward(angle))) << angle;
  for (const double angle : {0.1, 0.5}) EXPECT_FALSE(scan.sees(toward(angle))) << angle;
  EXPECT_TRUE(beams({2, nan, nan}).sees(toward(0))) << "its first beam";
  EXPECT_TRUE(beams({nan, nan, 2}).sees(toward(0.2))) << "its last one";
}

TEST(FloorScan, tellsHowMuchFartherThanAPointTheNearestThingBesideItLies) {
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  const ScanMount mount{{0.2, -0.1}, {1, 0}, {0, 1}};
  const FloorScan scan = beams({4, 4, 3, 2.5F, inf, inf, inf, nan, nan, nan, nan}, mount);
  const auto beyond = [&](double angle, double range, double beside) {
    const FloorPoint seen = toward(angle, range);
    return scan.beyond({seen.x + 0.2, seen.y - 0.1}, beside);
  };
  EXPECT_NEAR(beyond(0, 1, 0.05).value(), 3, 1e-6) << "the first beams";
  EXPECT_NEAR(beyond(0, 1, 0.15).value(), 2, 1e-6) << "0.15 m beside it";
  EXPECT_NEAR(beyond(0, 3.5, 0.3).value(), 0.5, 1e-6) << "of 3.5 m that is one beam";
  EXPECT_NEAR(beyond(0.3, 3, 0.05).value(), -0.5, 1e-6) << "before it";
  EXPECT_TRUE(std::isinf(beyond(0.5, 2, 0.05).value()));
  EXPECT_FALSE(beyond(0.9, 2, 0.05)) << "blind";
  EXPECT_FALSE(beyond(2, 2, 0.05)) << "nobody looks";
}

TEST(FloorScan, beginsAFullCircleAnywhere) {
  for (const auto& [begin, beam] : {std::pair(0., 12u), {-2 * kPi, 4u}, {-kPi, 4u}}) {
    RangeScan ranges;
    ranges.angle_min = begin;
    ranges.angle_increment = kPi / 8;
    ranges.range_max = 10;
    ranges.ranges.assign(16, std::nanf(""));
    ranges.ranges[beam] = 2;
    const FloorScan scan(ranges, {}, nullptr, {});
    const double there = begin + beam * kPi / 8;
    EXPECT_TRUE(scan.sees(toward(there))) << begin;
    EXPECT_FALSE(scan.sees(toward(there + kPi / 2))) << begin;
    EXPECT_FALSE(scan.sees(toward(there + kPi))) << begin;
  }
}

TEST(FloorScan, isTurnedAsTheRangeFinderIsMounted) {
  RangeScan ranges;  // one beam to the left, of one that hangs upside down
  ranges.angle_min = 0.5;
  ranges.angle_increment = 0.01;
  ranges.range_max = 10;
  ranges.ranges = {2};
  const FloorScan scan(ranges, {{0.2, 0}, {1, 0}, {0, -1}}, nullptr, {});
  EXPECT_NEAR(scan.points()[0].at.x, 0.2 + 2 * std::cos(0.5), 1e-6);
  EXPECT_NEAR(scan.points()[0].at.y, -2 * std::sin(0.5), 1e-6);
  EXPECT_TRUE(scan.sees(scan.points()[0].at));
  EXPECT_FALSE(scan.sees({2, 1}));
  const FloorScan aside(ranges, {{0.2, 0}, {0, 1}, {-1, 0}}, nullptr, {});  // a quarter turn
  EXPECT_NEAR(aside.points()[0].at.x, 0.2 - 2 * std::sin(0.5), 1e-6);
  EXPECT_NEAR(aside.points()[0].at.y, 2 * std::cos(0.5), 1e-6);
  EXPECT_TRUE(aside.sees(aside.points()[0].at));
}

}  // namespace
}  // namespace afterglow::replay::swept_path_test

// A recorded drive is driven again by a robot with other wheels, from a start that is a little off,
// seen by a noisy localization. Errors are measured against where the robots truly were.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "replay/motion/base/base_tracker.hpp"
#include "tests/support/simulated_replay.hpp"

namespace afterglow::replay::base_detour_test {
namespace {

using namespace test;

struct Errors {
  std::vector<double> position, turn, on_the_way, later;
};

double percentile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1) + 0.5)];
}

std::string medianAnd95(const std::vector<double>& values, double unit) {
  char text[40];
  std::snprintf(text, sizeof(text), "%5.2f /%5.2f", percentile(values, 0.5) / unit,
                percentile(values, 0.95) / unit);
  return text;
}

/// 1 % of wheel scale, of turns too; slip.
DriveFaults otherWheels(Bell& bell) {
  DriveFaults faults;
  faults.distance_scale = 1 + bell(0.01);
  faults.turn_scale = 1 + bell(0.01);
  faults.slip = 0.02;
  return faults;
}

/// As rosbag play would do it, with perfect timing.
PlanarPose replayBlindly(const RecordedDrive& recorded, const PlanarPose& start,
                         const DriveFaults& faults, std::uint32_t seed) {
  SimulatedDrive robot(start, {}, faults, seed);
  const auto steps = static_cast<int>(recorded.commands.size()) * 2;
  for (int i = 0; i < steps + 50; ++i) {
    if (i % 2 == 0 && i < steps) {
      robot.command(i * kStep, recorded.commands[static_cast<std::size_t>(i / 2)]);
    }
    robot.step(i * kStep);
  }
  return robot.truth();
}

struct Figure {
  Errors open, closed;
};

/// 50 replays of the detour, of as many recordings.
Figure replayTheDetour(const char* title, const LocalizationFaults& recording,
                       const LocalizationFaults& replaying, double stood) {
  Figure figure;
  TrackerOptions options;
  options.noise.position = replaying.position;
  options.noise.yaw = replaying.yaw;
  for (std::uint32_t run = 0; run < 50; ++run) {
    Bell bell(run * 17 + 3);
    DriveFaults slipping;
    slipping.slip = 0.02;
    const RecordedDrive recorded =
        record(detour(), slipping, recording, run + 500, options.noise, stood);
    const DriveFaults faults = otherWheels(bell);
    const PlanarPose start_error = bell.pose(0.01, 0.5 * kDegree);
    const PlanarPose blind =
        replayBlindly(recorded, compose(recorded.start, start_error), faults, run);
    figure.open.position.push_back(distance(blind, recorded.end));
    figure.open.turn.push_back(std::abs(wrapAngle(blind.yaw - recorded.end.yaw)));
    Replay replay(recorded, options, start_error, faults, replaying, run + 900);
    replay.run();
    EXPECT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
    figure.closed.position.push_back(replay.endError());
    figure.closed.turn.push_back(replay.endTurn());
    figure.closed.on_the_way.push_back(replay.largest);
    figure.closed.later.push_back(replay.now() -
                                  static_cast<double>(recorded.truth.size()) * kStep);
  }
  std::printf(
      "%s, median / 95%%: open loop %s cm %s deg; closed loop %s cm %s deg, on the way %s "
      "cm, %s s longer\n",
      title, medianAnd95(figure.open.position, 0.01).c_str(),
      medianAnd95(figure.open.turn, kDegree).c_str(),
      medianAnd95(figure.closed.position, 0.01).c_str(),
      medianAnd95(figure.closed.turn, kDegree).c_str(),
      medianAnd95(figure.closed.on_the_way, 0.01).c_str(),
      medianAnd95(figure.closed.later, 1).c_str());
  return figure;
}

TEST(BaseDetour, endsTheDetourWithin2CmOnA3CmLocalization) {
  const Figure figure = replayTheDetour("3 cm, exact recording", kExact, k3Cm, 0);
  EXPECT_LT(percentile(figure.closed.position, 0.95), 0.02);
  EXPECT_LT(percentile(figure.closed.turn, 0.95), 0.6 * kDegree);
  EXPECT_LT(percentile(figure.closed.on_the_way, 0.95), 0.08);
  EXPECT_GT(percentile(figure.open.position, 0.5), 0.03);
}

TEST(BaseDetour, endsTheDetourWithin1CmOnA1CmLocalization) {
  const Figure figure = replayTheDetour("1 cm, exact recording", kExact, k1Cm, 0);
  EXPECT_LT(percentile(figure.closed.position, 0.95), 0.01);
  EXPECT_LT(percentile(figure.closed.turn, 0.95), 0.6 * kDegree);
}

TEST(BaseDetour, endsTheDetourAsWellWhenItWasRecordedByTheSameLocalization) {
  const Figure coarse =
      replayTheDetour("3 cm, recorded likewise and 10 s of standing", k3Cm, k3Cm, 10);
  EXPECT_LT(percentile(coarse.closed.position, 0.95), 0.02);
  EXPECT_LT(percentile(coarse.closed.turn, 0.95), 0.6 * kDegree);
  const Figure fine =
      replayTheDetour("1 cm, recorded likewise and 10 s of standing", k1Cm, k1Cm, 10);
  EXPECT_LT(percentile(fine.closed.position, 0.95), 0.01);
  EXPECT_LT(percentile(fine.closed.turn, 0.95), 0.6 * kDegree);
}

TEST(BaseDetour, isAlmostAsGoodWithALessKnownEnd) {
  const Figure figure = replayTheDetour("3 cm, recorded likewise, stopped at once", k3Cm, k3Cm, 0);
  EXPECT_LT(percentile(figure.closed.position, 0.95), 0.03);
  EXPECT_LT(percentile(figure.closed.turn, 0.95), 1.2 * kDegree);
}

}  // namespace
}  // namespace afterglow::replay::base_detour_test

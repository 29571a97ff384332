// What a replay says of how well it knows where its base ended, with a localization that has the
// manners of amcl: it looks again after 0.1 m or 0.25 rad only.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "tests/support/simulated_replay.hpp"

namespace afterglow::replay::end_doubt_test {
namespace {

using namespace test;

/// Each look is off by an error of its own.
class Amcl {
 public:
  Amcl(double position, double yaw, std::uint32_t seed)
      : position_(position), yaw_(yaw), bell_(seed) {}
  StampedPose look(double now, const SimulatedDrive& drive) {
    const PlanarPose moved = between(looked_at_, drive.odometry());
    if (!known_ || std::hypot(moved.x, moved.y) > 0.1 || std::abs(moved.yaw) > 0.25) {
      looked_at_ = drive.odometry();
      const PlanarPose truth = drive.truth(), off = bell_.pose(position_, yaw_);
      known_ = compose({truth.x + off.x, truth.y + off.y, truth.yaw + off.yaw},
                       inverse(drive.odometry()));
    }
    return {stampAt(now), *known_};
  }

 private:
  double position_, yaw_;
  Bell bell_;
  PlanarPose looked_at_;
  std::optional<PlanarPose> known_;
};

constexpr double kPosition = 0.02, kYaw = 0.01;

RecordedDrive recordByAmcl(const Commands& commands, std::uint32_t seed) {
  DriveFaults slipping;
  slipping.slip = 0.02;
  SimulatedDrive robot({2, 1, 0.3}, {}, slipping, seed);
  Amcl amcl(kPosition, kYaw, seed + 1);
  TrackBuilder builder{LocalizationNoise()};
  std::vector<PlanarPose> truth;
  const auto steps = static_cast<int>(commands.size()) * 2;
  for (int i = 0; i < steps + 50; ++i) {
    const double now = i * kStep;
    if (i % 2 == 0 && i < steps) robot.command(now, commands[static_cast<std::size_t>(i / 2)]);
    builder.addOdometry(stampAt(now), robot.odometry());
    builder.addLocalization(stampAt(now), amcl.look(now, robot).pose);
    truth.push_back(robot.truth());
    robot.step(now);
  }
  return {truth.front(), truth.back(), truth, builder.build("map", "odom"), commands};
}

TEST(EndDoubt, ofALocalizationLikeAmclCoversWhereTheBaseTrulyEnded) {
  int covered = 0;
  constexpr int kRuns = 20;
  for (std::uint32_t seed = 1; seed <= kRuns; ++seed) {
    Commands commands;
    drive(commands, 2, 0.2);
    const RecordedDrive recorded = recordByAmcl(commands, seed * 10);
    Replay replay(recorded, {}, {}, {1.01, 0.99, 0.02, 0.08});
    Amcl amcl(kPosition, kYaw, seed + 1000);
    replay.disturb = [&](double now, BaseInput& input) {
      input.T_map_odom = amcl.look(now, replay.robot);
    };
    replay.run();
    ASSERT_EQ(replay.tracker.state(), BaseState::Done) << replay.tracker.reason();
    const BaseReport report = replay.tracker.report();
    const PoseError now = replay.tracker.localizer()->error(recorded.track.measured_error);
    EXPECT_NEAR(report.end_doubt.position,
                2 * std::hypot(now.position, recorded.track.end_error.position), 1e-9)
        << "of now and then";
    EXPECT_NEAR(report.end_doubt.yaw, 2 * std::hypot(now.yaw, recorded.track.end_error.yaw), 1e-9);
    EXPECT_GT(report.end_doubt.position, 0.005) << "it cannot know it better";
    EXPECT_LT(report.end_doubt.position, 0.1) << "nor is it told nothing";
    EXPECT_LT(report.gone_since_localized, 0.15);
    covered += replay.endError() <= report.end_distance + report.end_doubt.position ? 1 : 0;
  }
  EXPECT_GE(covered, 16) << "two standard deviations";
}

}  // namespace
}  // namespace afterglow::replay::end_doubt_test

// A base that is driven along its track within a replay: light and speech go where it is.
#include <gtest/gtest.h>

#include <cmath>

#include "replay/motion/planar_pose.hpp"
#include "tests/support/player_world.hpp"
#include "tests/support/simulated_drive.hpp"

namespace afterglow::replay::player_base_test {
namespace {

using namespace test;

constexpr double kSpeed = 0.25;  // m/s
/// m that it rolls on when it is told to stand: 0.08 s, and braking at 0.75 m/s^2.
constexpr double kBrakingWay = kSpeed * 0.08 + kSpeed * kSpeed / 2 / 0.75 + 0.01;
constexpr std::int64_t kFrom = 1500, kTo = 5500, kEnd = 7500;

/// How far the base had come, so many milliseconds into the recording: it speeds up and brakes for
/// half a second each.
double recordedWay(std::int64_t ms) {
  const double seconds = std::clamp<double>(static_cast<double>(ms - kFrom) / 1000, 0, 4);
  const double ramp = kSpeed / 0.5;
  if (seconds < 0.5) return ramp * seconds * seconds / 2;
  if (seconds > 3.5) return kSpeed * 3.5 - ramp * (4 - seconds) * (4 - seconds) / 2;
  return kSpeed * (seconds - 0.25);
}

/// A robot that hears the sink, and light every 50 ms, each with where the robot was then.
struct PlayerBase : PlayerWorld {
  void SetUp() override {
    options.clear_projection = false;
    std::vector<PoseTrack::Sample> samples;
    for (std::int64_t ms = 0; ms <= kEnd; ms += 20) {
      samples.push_back({{kBegin + ms * kMs}, {recordedWay(ms), 0, 0}});
    }
    PoseTrack track(std::move(samples), "odom", false);
    track.stands = {{{kBegin}, {kBegin + kFrom * kMs}},
                    {{kBegin + kTo * kMs}, {kBegin + kEnd * kMs}}};
    TrackerOptions tracking;
    tracking.with_localization = false;
    drive = std::make_unique<BaseDrive>(
        kCmdVel.topic, twist(0), track, track.begin(), track.end(), tracking, [this](Stamp now) {
          live();
          return BaseInput{now, StampedPose{now, robot.odometry()}, std::nullopt};
        });
    options.base_drive = drive.get();
    for (std::int64_t ms = kFrom; ms < kTo; ms += 100) record(kCmdVel, ms, twist(9));
    for (std::int64_t ms = 0; ms < kEnd; ms += 50) {
      record(kMarkers, ms, test::markers(1));
      recorded_light.push_back(ms);
    }
    sink.on_publish = [this](const Sent& sent) {
      live();
      if (sent.topic == kMarkers.topic) lit_at.push_back(robot.truth().x);
      if (sent.topic == kCmdVel.topic) {
        const Velocity velocity = velocityOf(sent.bytes);
        robot.command(seconds(), {velocity[0], velocity[5]});
      }
    };
  }
  double seconds() const { return static_cast<double>(clock.now().ns) * 1e-9; }
  void live() {
    for (; lived < seconds(); lived += kStep) robot.step(lived);
  }
  /// m between where the robot was when each light went out and where it was recorded.
  double largestOffset() const {
    double largest = 0;
    for (std::size_t i = 0; i < lit_at.size(); ++i) {
      largest = std::max(largest, std::abs(lit_at[i] - recordedWay(recorded_light.at(i))));
    }
    return largest;
  }

  SimulatedDrive robot{{}, {}, {}, 1};
  double lived = seconds();
  std::unique_ptr<BaseDrive> drive;
  Times recorded_light;
  std::vector<double> lit_at;
};

TEST_F(PlayerBase, isDrivenInsteadOfItsRecordedVelocities) {
  const PlayReport report = play(kEnd);
  EXPECT_TRUE(report.is_complete) << report.reason;
  for (const auto& [planned, topic] : report.topics) {
    EXPECT_EQ(topic.replaced, planned.channel.topic == kCmdVel.topic ? 40u : 0u);
  }
  for (const Sent& sent : sink.on(kCmdVel.topic)) EXPECT_NE(sent.bytes, twist(9));
  EXPECT_NEAR(robot.truth().x, kSpeed * 3.5, 0.01);
  EXPECT_LT(largestOffset(), 0.02);
  EXPECT_EQ(sink.sent.back().bytes, twist(0));
  ASSERT_TRUE(report.base && report.base->driven);
  EXPECT_EQ(report.base->driven->drives.size(), 1u);
  EXPECT_GT(report.base->deviation.count(), 100u);
  EXPECT_LE(report.in_step.skew.at(Modality::Ar).size.quantile(0.95), 20 * kMs);
}

TEST_F(PlayerBase, isWaitedForWhereItIsStuck) {
  at(3000, [this] { live(), robot.is_stuck = true; });
  at(4500, [this] { live(), robot.is_stuck = false; });
  const PlayReport report = play(kEnd);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_LT(largestOffset(), 0.2) << "the law's reference is so far ahead before it stands";
  EXPECT_NEAR(robot.truth().x, kSpeed * 3.5, 0.01);
  EXPECT_GT(report.in_step.waited_s, 1.0);
  EXPECT_EQ(report.in_step.waits.front().what, kCmdVel.topic);
  EXPECT_LE(report.in_step.skew.at(Modality::Ar).size.quantile(0.95), 20 * kMs);
}

TEST_F(PlayerBase, runsAheadOfAStuckBaseWithoutTheGateButEndsWithIt) {
  at(3000, [this] { live(), robot.is_stuck = true; });
  at(4500, [this] { live(), robot.is_stuck = false; });
  options.is_in_step = false;
  const PlayReport report = play(kEnd);
  EXPECT_EQ(sink.times(kMarkers.topic), recorded_light);
  EXPECT_GT(largestOffset(), 0.3);
  EXPECT_NEAR(robot.truth().x, kSpeed * 3.5, 0.01);
  EXPECT_GT(report.in_step.skew.at(Modality::Ar).size.quantile(0.95), 1000 * kMs);
}

TEST_F(PlayerBase, standsWhileAGoalIsWaitedFor) {
  record(kArm, 1000, goalMessage("a", {2.0}));
  recordResult(kArm, 3000, "a");
  at(4500, [this] {
    live();
    EXPECT_NEAR(robot.velocity().forward, 0, 1e-6);
    EXPECT_NEAR(robot.truth().x, recordedWay(3000), kBrakingWay);
    player->onGoalStatus("fresh-1", 3);
  });
  const PlayReport report = play(kEnd);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_LT(largestOffset(), kBrakingWay);
  EXPECT_NEAR(robot.truth().x, kSpeed * 3.5, 0.01);
}

TEST_F(PlayerBase, standsInAPauseAndGoesOn) {
  at(3000, [this] { player->pause(); });
  at(4000, [this] {
    live();
    EXPECT_NEAR(robot.velocity().forward, 0, 1e-6);
    EXPECT_EQ(sink.on(kCmdVel.topic).back().at_ms, 3000);
    EXPECT_EQ(sink.on(kCmdVel.topic).back().bytes, twist(0));
    player->resume();
  });
  const PlayReport report = play(kEnd);
  EXPECT_TRUE(report.is_complete) << report.reason;
  EXPECT_LT(largestOffset(), kBrakingWay);
  EXPECT_NEAR(robot.truth().x, kSpeed * 3.5, 0.01);
}

TEST_F(PlayerBase, endsTheReplayWhenItIsLost) {
  at(3000, [this] { live(), robot.is_stuck = true; });
  const PlayReport report = play(kEnd);
  EXPECT_FALSE(report.is_complete);
  EXPECT_EQ(report.reason.find("body failed: the base: "), 0u) << report.reason;
  EXPECT_EQ(sink.on(kCmdVel.topic).back().bytes, twist(0));
  EXPECT_LT(sink.times(kMarkers.topic).size(), recorded_light.size());
}

}  // namespace
}  // namespace afterglow::replay::player_base_test

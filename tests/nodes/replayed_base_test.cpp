// The base of a replay, as far as its recording and the options tell, and what open loop is
// allowed. No master is asked.
#include "nodes/player/replayed_base.hpp"

#include <gtest/gtest.h>
#include <ros/time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/anchored_world.hpp"
#include "tests/support/simulated_scan.hpp"

namespace afterglow::nodes::replayed_base_test {
namespace {

using test::rosBytes;
using test::rosChannel;
using Texts = std::vector<std::string>;

/// A straight drive of a meter, from 1 s to 5 s of 6 s, was recorded; its fastest is 0.39 m/s.
struct ReplayedBaseTest : test::AnchoredWorld {
  static double turnAt(int ms) { return replay::kPi / 4000 * std::clamp(ms - 1000, 0, 4000); }
  static double wayAt(int ms) { return 0.5 - 0.5 * std::cos(turnAt(ms)); }

  void recordPoses(bool is_localized = true) {
    const Texts own = topics;
    for (int ms = 0; ms <= 6000; ms += 20) {
      tf2_msgs::TFMessage message;
      message.transforms = {stamped("odom", "base_link", planar(wayAt(ms), 0, 0), recordedAt(ms))};
      if (is_localized) {
        message.transforms.push_back(stamped("map", "odom", planar(1, 2, 0), recordedAt(ms)));
      }
      record(rosChannel<tf2_msgs::TFMessage>("/tf"), ms, rosBytes(message));
    }
    topics = own;
  }
  void recordVelocities(const std::string& topic = "/cmd_vel", double fastest = 0.39) {
    for (int ms = 1000; ms < 5000; ms += 50) {
      record(test::twistChannel(topic), ms, test::twist(fastest * std::sin(turnAt(ms))));
    }
    record(test::twistChannel(topic), 5000, test::twist(0));
  }
  void makePlanOfAll() {
    replay::Behavior behavior;
    behavior.recording = recording;
    behavior.begin = {test::kBegin};
    behavior.end = recordedAt(6000);
    behavior.topics = topics;
    behavior.id = store->addBehavior(behavior);
    plan_options.is_motion_allowed = true;
    plan_options.settled = replay::topicNames(topics);
    plan = replay::makePlan(*store, behavior, plan_options);
  }
  RecordedDrive drive() const { return {*store, plan, base}; }
  ReplayedBase replayed() const { return {*store, plan, base, limits}; }

  void SetUp() override { limits.linear_acceleration = 2; }

  BaseOptions base;
  replay::MotionLimits limits;
};

TEST_F(ReplayedBaseTest, isLedAlongItsPosesWhereTheseWereRecorded) {
  recordPoses();
  recordVelocities();
  makePlanOfAll();
  const RecordedDrive drive = this->drive();
  EXPECT_EQ(drive.why_not, "");
  EXPECT_EQ(drive.why_open_loop, "");
  EXPECT_EQ(drive.first_motion, recordedAt(1050)) << "a zero is no motion";
  EXPECT_EQ(drive.last_motion, recordedAt(4950));
  EXPECT_EQ(drive.sample, test::twist(0));
  EXPECT_TRUE(drive.track);
  EXPECT_EQ(replayed().recordedRefusal(), "");
}

TEST_F(ReplayedBaseTest, isRefusedWithoutLocalizationUnlessOdometryIsEnough) {
  recordPoses(false);
  recordVelocities();
  makePlanOfAll();
  EXPECT_EQ(replayed().recordedRefusal(),
            "the base cannot follow its recorded poses: it was recorded without localization (map "
            "-> odom); --odometry-only follows its odometry, from where it is; --open-loop "
            "(~open_loop) sends its recorded velocities, wherever they lead");
  base.is_odometry_enough = true;
  EXPECT_EQ(replayed().recordedRefusal(), "");
  base.is_odometry_enough = false;
  base.is_open_loop = true;
  EXPECT_EQ(replayed().recordedRefusal(), "");
  EXPECT_EQ(drive().why_open_loop, "that was asked for");
}

TEST_F(ReplayedBaseTest, isRefusedWhereTheRecordingsTimeIsPlayed) {
  recordPoses();
  recordVelocities();
  makePlanOfAll();
  base.has_recorded_time = true;
  EXPECT_EQ(drive().why_not, "the recording's time is played, which the robot's poses do not keep");
}

TEST_F(ReplayedBaseTest, needsNoTrackWhereOnlyZerosWereRecorded) {
  recordVelocities("/cmd_vel", 0);
  makePlanOfAll();
  EXPECT_EQ(drive().why_open_loop, "its recorded velocities are zeros");
  EXPECT_EQ(replayed().recordedRefusal(), "");
  EXPECT_EQ(replayed().scanRefusal(), "");
}

TEST_F(ReplayedBaseTest, isTheNamedOneOfSeveralTopicsOrTheUsualOne) {
  recordPoses();
  recordVelocities("/cmd_vel");
  recordVelocities("/other");
  makePlanOfAll();
  EXPECT_EQ(drive().topic, nullptr);
  EXPECT_EQ(drive().played_topics, "/cmd_vel, /other");
  EXPECT_EQ(drive().why_not,
            "velocities are played on /cmd_vel, /other, and it was not said which are the base's "
            "(--base-topic, ~base_topic)");
  base.usual_topic = "/cmd_vel";
  ASSERT_TRUE(drive().topic);
  EXPECT_EQ(drive().topic->channel.topic, "/cmd_vel");
  base.topic = "/other";
  EXPECT_EQ(drive().topic->channel.topic, "/other");
  base.topic = "/third";
  EXPECT_THROW(drive(), std::runtime_error);
  for (auto& topic : plan.topics) topic.output.topic = "/renamed" + topic.output.topic;
  base.topic = "/renamed/other";
  EXPECT_EQ(drive().topic->channel.topic, "/other") << "by its published name, too";
}

TEST_F(ReplayedBaseTest, needsAScanUnlessThatIsWaived) {
  recordPoses();
  recordVelocities();
  makePlanOfAll();
  EXPECT_EQ(replayed().scanRefusal().find("nothing sees what stands in the base's way"), 0u);
  base.scan.topic = "/base_scan";
  EXPECT_EQ(replayed().scanRefusal(), "");
  base.scan.topic.clear();
  base.scan.is_waived = true;
  EXPECT_EQ(replayed().scanRefusal(), "");
}

TEST_F(ReplayedBaseTest, tellsOfADriveThatItsLimitsMakeLonger) {
  recordPoses();
  recordVelocities();
  makePlanOfAll();
  EXPECT_EQ(replayed().slowedDrives(), Texts{});
  limits.linear = 0.2;
  const Texts slowed = replayed().slowedDrives();
  ASSERT_EQ(slowed.size(), 1u);
  double at = 0, takes = 0, wanted = 0;
  ASSERT_EQ(std::sscanf(slowed[0].c_str(),
                        "the drive at %lf s takes %lf s instead of %lf s, as the base may not be "
                        "faster",
                        &at, &takes, &wanted),
            3)
      << slowed[0];
  EXPECT_NEAR(at, 1, 0.3);
  EXPECT_NEAR(wanted, 4, 0.3);
  EXPECT_NEAR(takes, 6, 0.6);
  EXPECT_EQ(replayed().recordedRefusal(), "") << "the rest waits";
  base.keeps_rate = true;
  EXPECT_EQ(replayed().recordedRefusal(),
            slowed[0] + "; without --keep-rate the rest waits for it");
  base.rate = 0.5;
  EXPECT_EQ(replayed().slowedDrives(), Texts{}) << "so slowly it is in time";
  base.rate = 2;
  limits.linear = 0.4;
  ASSERT_EQ(replayed().slowedDrives().size(), 1u);
  const std::string twice = " instead of " + std::to_string(wanted / 2).substr(0, 3);
  EXPECT_NE(replayed().slowedDrives()[0].find(twice), std::string::npos);
}

TEST_F(ReplayedBaseTest, reportsOpenLoopAndWhatItWaitedFor) {
  recordVelocities();
  makePlanOfAll();
  base.is_open_loop = true;
  replay::PlayReport report;
  replayed().addTo(report);
  ASSERT_TRUE(report.base);
  EXPECT_EQ(report.base->why_open_loop, "that was asked for");
  EXPECT_EQ(report.base->topic, "/cmd_vel");
  ASSERT_EQ(report.notes.size(), 1u);
  EXPECT_EQ(report.notes[0],
            "the base was driven in open loop, by its recorded velocities, and ended wherever they "
            "led: that was asked for");
}

TEST_F(ReplayedBaseTest, reportsForWhatItWaitedAndWhatItLeft) {
  recordPoses();
  recordVelocities();
  makePlanOfAll();
  replay::PlayReport report;
  replay::BaseDriveReport& driven = report.base.emplace().driven.emplace();
  driven.frame = "map";
  driven.obstacles.waits = {{1.5, -0.02, {1, 2}, recordedAt(2000)},
                            {2, std::numeric_limits<double>::infinity(), {}, recordedAt(2500)}};
  driven.obstacles.unseen = 0.01;
  driven.drives.resize(2);
  driven.drives[0].base.left_aside = 0.0009;
  driven.drives[1].base.left_aside = 0.001;
  replayed().addTo(report);
  EXPECT_EQ(
      report.notes,
      (Texts{"the base waited 1.5 s for something 0.00 m from it, at (1.00, 2.00) in map, "
             "2.0 s into the behavior",
             "the base waited 2.0 s for a scan, 2.5 s into the behavior",
             "the base was left 0.1 cm beside where it had stood: it was not recorded to turn "
             "there"}));
  driven.obstacles = {};
  driven.obstacles.unseen = 0.02;
  driven.drives.clear();
  report.notes.clear();
  replayed().addTo(report);
  EXPECT_EQ(report.notes, Texts{"the base drove 0.02 m where the scan does not look: as it was "
                                "recorded, and slowly"});
}

/// A base that is driven in open loop: what gets through, and why the replay was stopped.
struct OpenLoop : replay::MessageSink {
  explicit OpenLoop(const std::vector<test::Disc>& discs) : discs_(discs) {
    ros::Time::init();
    replay::PlannedTopic topic;
    topic.channel = topic.output = test::twistChannel("/cmd_vel");
    plan.topics.push_back(topic);
    topic.channel = topic.output = test::twistChannel("/left_out");
    topic.why_not = "it was excluded";
    plan.topics.push_back(topic);
    topic.channel = topic.output = test::trajectoryGoalChannel("/arm/goal");
    topic.why_not.clear();
    plan.topics.push_back(topic);
    monitor.emplace(
        plan, *this, replay::ObstacleOptions(), [this] { return look(); },
        [this](const std::string& why) { reason = why; });
  }
  bool publish(const replay::Channel&, const replay::Bytes& bytes) override {
    sent.push_back(bytes);
    return true;
  }
  replay::BaseInput look() {
    now += 0.1;
    replay::BaseInput input;
    input.now = test::stampAt(now);
    input.T_odom_base = replay::StampedPose{input.now, {}};
    if (sees) input.scan = test::scanOf(discs_, {}, now);
    return input;
  }
  /// Several times, so that thin things count.
  OpenLoop& drive(double speed, const std::string& topic = "/cmd_vel") {
    for (int i = 0; i < 5 && reason.empty(); ++i) {
      monitor->publish(test::twistChannel(topic), test::twist(speed));
    }
    return *this;
  }

  const std::vector<test::Disc> discs_;
  replay::PlayPlan plan;
  std::optional<OpenLoopMonitor> monitor;
  std::vector<replay::Bytes> sent;
  std::string reason;
  double now = 0;
  bool sees = true;
};

TEST(OpenLoopMonitor, letsTheBaseDriveWhereItsWayIsFree) {
  OpenLoop loop({});
  loop.drive(0.4);
  EXPECT_EQ(loop.reason, "");
  EXPECT_EQ(loop.sent, std::vector<replay::Bytes>(5, test::twist(0.4)));
}

TEST(OpenLoopMonitor, endsTheReplayWithAZeroBeforeWhatStandsInItsWay) {
  OpenLoop loop({{0.9, 0, 0.15}});
  loop.drive(0.8);
  EXPECT_EQ(loop.reason.find("the base, which cannot wait in open loop: something "), 0u)
      << loop.reason;
  ASSERT_FALSE(loop.sent.empty());
  EXPECT_EQ(loop.sent.back(), test::twist(0));
  EXPECT_EQ(OpenLoop({{0.9, 0, 0.15}}).drive(0.8, "/left_out").reason, "")
      << "only what is played drives the base";
  EXPECT_EQ(OpenLoop({{0.9, 0, 0.15}}).drive(0).reason, "") << "a zero is always sent";
}

TEST(OpenLoopMonitor, goesBackSlowlyWhereItsScanDoesNotLook) {
  EXPECT_EQ(OpenLoop({}).drive(-0.2).reason, "");
  EXPECT_EQ(OpenLoop({}).drive(-0.21).reason,
            "the base, which cannot wait in open loop: 0.21 m/s where the scan does not look are "
            "too fast");
}

TEST(OpenLoopMonitor, driveNowhereWithoutAScan) {
  OpenLoop blind({});
  blind.sees = false;
  EXPECT_NE(blind.drive(0.1).reason, "");
}

}  // namespace
}  // namespace afterglow::nodes::replayed_base_test

// Rates that are right for motion: what a message becomes, what is too fast, and changes under way.
#include <gtest/gtest.h>

#include "replay/messages/field_edit.hpp"
#include "replay/motion/motion_limits.hpp"
#include "replay/motion/planar_pose.hpp"
#include "tests/support/player_world.hpp"

namespace afterglow::replay::player_rate_test {
namespace {

using namespace test;
using PlayerRate = PlayerWorld;

const Channel kCommand =
    channelOf("/arm_controller/command", "trajectory_msgs/JointTrajectory", kBareTrajectory);
const std::string kGoals = kArm.topic;
const std::string kCancels = "/arm/follow_joint_trajectory/cancel";

MotionLimits fetchLimits() {
  MotionLimits limits;
  limits.linear = 1.0;
  limits.joints["elbow_flex_joint"].velocity = 1.521;
  return limits;
}

Value doubles(const std::vector<double>& numbers) {
  Bytes bytes(numbers.size() * sizeof(double));
  if (!bytes.empty()) std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return NumberArray{FieldType::Float64, bytes};
}

std::vector<double> doublesAt(Value& point, const std::string& field) {
  const auto& array = std::get<NumberArray>(test::at(point, field));
  std::vector<double> numbers(array.size());
  if (!numbers.empty()) std::memcpy(numbers.data(), array.bytes.data(), array.bytes.size());
  return numbers;
}

/// A goal for "elbow_flex_joint": 0 rad at 1 s, 0.9 rad at 2 s, with all that a point can say.
Bytes elbowGoal(const std::string& joint = "elbow_flex_joint") {
  const Schema schema = schemaOf(kArm);
  Value message = decode(schema, goalMessage("a", {1.0, 2.0}));
  test::at(message, "goal.trajectory.joint_names") = Array{joint};
  test::at(message, "goal.goal_time_tolerance") = RosDuration{5, 0};
  double position = 0;
  for (Value& point : std::get<Array>(test::at(message, "goal.trajectory.points"))) {
    test::at(point, "positions") = doubles({position});
    test::at(point, "velocities") = doubles({0.4});
    test::at(point, "accelerations") = doubles({0.3});
    test::at(point, "effort") = doubles({7});
    position = 0.9;
  }
  return encode(schema, message);
}

TEST(MotionRate, goesTheSameWayFaster) {
  Bytes bytes = elbowGoal();
  MotionRate(schemaOf(kArm)).apply(bytes, 2);
  Value message = decode(schemaOf(kArm), bytes);
  Value& last = std::get<Array>(test::at(message, "goal.trajectory.points")).back();
  EXPECT_EQ(timesFromStart(bytes), (std::vector<double>{0.5, 1.0}));
  EXPECT_EQ(doublesAt(last, "positions"), std::vector<double>{0.9});
  EXPECT_EQ(doublesAt(last, "velocities"), std::vector<double>{0.8});
  EXPECT_EQ(doublesAt(last, "accelerations"), std::vector<double>{1.2});
  EXPECT_EQ(doublesAt(last, "effort"), std::vector<double>{7});
  EXPECT_EQ(std::get<RosDuration>(test::at(message, "goal.goal_time_tolerance")).sec, 5);
}

TEST(MotionRate, knowsPointHeadAndMarkersAndLeavesTheRestAlone) {
  const Channel head =
      channelOf("/head/goal", "control_msgs/PointHeadActionGoal", kPointHeadActionGoal);
  std::vector<std::string> paths;
  for (const ScaledField& field : scaledFields(schemaOf(head))) paths.push_back(field.path);
  EXPECT_EQ(paths, (std::vector<std::string>{"goal.min_duration", "goal.max_velocity"}));
  paths.clear();
  for (const ScaledField& field : scaledFields(schemaOf(twistChannel("/any")))) {
    EXPECT_EQ(field.power, 1);
    paths.push_back(field.path);
  }
  EXPECT_EQ(paths.size(), 6u);
  EXPECT_TRUE(scaledFields(schemaOf(kCloud)).empty());
  Bytes cloud = test::cloud(3);
  MotionRate(schemaOf(kCloud)).apply(cloud, 2);
  EXPECT_EQ(cloud, test::cloud(3));
}

TEST_F(PlayerRate, drivesTheSameDistanceInAnotherTime) {
  for (const double rate : {0.1, 0.5, 2.0, 10.0}) {
    sink.sent.clear();
    options.rate = rate;
    if (sequence == 0) {
      for (int i = 0; i < 20; ++i) record(kCmdVel, i * 100, twist(0.01 * i));
    }
    const PlayReport report = play(2000);
    double distance = 0;  // of the velocities as they held
    const std::vector<Sent> sent = sink.on("/cmd_vel");
    for (std::size_t i = 0; i + 1 < sent.size(); ++i) {
      distance += velocityOf(sent[i].bytes)[0] *
                  static_cast<double>(sent[i + 1].at_ms - sent[i].at_ms) / 1000;
    }
    EXPECT_NEAR(distance, 0.01 * 190 * 0.1, 1e-12) << rate;
    EXPECT_EQ(report.actual_ns, report.planned_ns) << rate;
    clock = JumpingClock();
  }
}

TEST_F(PlayerRate, doesNotDriftInTwoHoursAtRateTwenty) {
  const std::int64_t two_hours = 2 * 3600 * 1000;
  for (int i = 0; i < 7200; ++i) record(kSay, i * 1000, test::text("x"));
  options.rate = 20;
  sink.on_publish = [this](const Sent&) { clock.stall(300'000); };  // each send takes 0.3 ms
  const PlayReport report = play(two_hours);
  EXPECT_EQ(sink.sent.size(), 7200u);
  for (std::size_t i = 0; i < sink.sent.size(); ++i) {
    ASSERT_EQ(sink.sent[i].at_ms, static_cast<std::int64_t>(i) * 50);
  }
  EXPECT_EQ(report.topics.at(0).second.lateness.max(), 0);
  EXPECT_EQ(report.actual_ns, two_hours / 20 * kMs);
}

TEST_F(PlayerRate, changesUnderWayWithTheRestOfATrajectoryAtTheNewRate) {
  record(kArm, 0, goalMessage("a", {1.0, 2.0, 3.0}));
  record(kCmdVel, 1400, twist(0.2));
  record(kCmdVel, 1900, twist(0.1));
  at(1500, [this] { player->setRate(0.5); });
  at(1700, [this] { EXPECT_EQ(player->progress().rate, 0.5); });
  at(4500, [this] { player->onGoalStatus("fresh-2", 3); });
  const PlayReport report = play(3000);
  EXPECT_EQ(sink.times(kCancels), Times{1500});
  const std::vector<Sent> goals = sink.on(kGoals);
  ASSERT_EQ(goals.size(), 2u);
  EXPECT_EQ(goals[1].at_ms, 1500);
  EXPECT_EQ(timesFromStart(goals[1].bytes), (std::vector<double>{1.0, 3.0}));
  const std::vector<Sent> driven = sink.on("/cmd_vel");
  EXPECT_EQ(sink.times("/cmd_vel"), (Times{1400, 1500, 2300, 4500, 4500}));
  EXPECT_EQ(driven[1].bytes, twist(0.1)) << "0.2 m/s at half the rate, at once";
  EXPECT_EQ(driven[2].bytes, twist(0.05));
  EXPECT_TRUE(report.is_complete);
}

TEST_F(PlayerRate, resumesAtTheRateThatWasSetInAPause) {
  record(kSay, 0, test::text("a"));
  record(kSay, 1000, test::text("b"));
  at(500, [this] { player->pause(); });
  at(600, [this] { player->setRate(2); });
  at(700, [this] { player->resume(); });
  EXPECT_THROW(Player(*store, PlayPlan{}, options, sink, clock, {}, {}).setRate(0),
               std::runtime_error);
  play(1001);
  EXPECT_EQ(sink.times("/robotsound"), (Times{0, 950}));
}

TEST_F(PlayerRate, sendsNoBurstAfterAStallAtAnotherRate) {
  for (int i = 0; i < 100; ++i) record(kCmdVel, i * 10, twist(1 + i));
  options.rate = 2;
  sink.on_publish = [this](const Sent& sent) {
    if (sent.bytes == twist(2 * 11)) clock.stall(105 * kMs);  // at 50 ms
  };
  play(1000);
  const std::vector<Sent> sent = sink.on("/cmd_vel");
  ASSERT_GT(sent.size(), 12u);
  EXPECT_EQ(sent[11].at_ms, 155);
  EXPECT_EQ(sent[11].bytes, twist(2 * 32)) << "the newest that is due";
}

TEST_F(PlayerRate, haltsATrajectoryCommandInAPauseAndSendsItsRest) {
  const Schema schema = schemaOf(kCommand);
  Value goal = decode(schemaOf(kArm), elbowGoal());
  record(kCommand, 0, encode(schema, test::at(goal, "goal.trajectory")));
  at(1500, [this] { player->pause(); });
  at(2500, [this] { player->resume(); });
  play(3000);
  const std::vector<Sent> sent = sink.on(kCommand.topic);
  ASSERT_EQ(sent.size(), 3u);
  Value halt = decode(schema, sent[1].bytes), rest = decode(schema, sent[2].bytes);
  EXPECT_EQ(sent[1].at_ms, 1500);
  EXPECT_TRUE(std::get<Array>(test::at(halt, "points")).empty());
  auto& points = std::get<Array>(test::at(rest, "points"));
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(std::get<RosDuration>(test::at(points[0], "time_from_start")).nsec, 500'000'000);
}

// ----------------------------------------------------------------------------------------- limits

TEST_F(PlayerRate, namesTopicValueAndTimeOfWhatIsTooFast) {
  record(kCmdVel, 0, twist(0.3));
  record(kCmdVel, 700, twist(-0.6));
  record(kArm, 1000, elbowGoal());
  play(2000);
  const auto peaks = motionPeaks(*store, plan, fetchLimits());
  EXPECT_EQ(whyTooFast(peaks, 1.0), "");
  EXPECT_EQ(whyTooFast(peaks, 1.6), "");
  EXPECT_EQ(
      whyTooFast(peaks, 1.68),
      "/cmd_vel: linear velocity of 1.008 m/s at rate 1.68, 0.7 s into the behavior, is above "
      "the limit of 1");
  const auto arm = motionPeaks(*store,
                               makePlan(*store, plan.behavior,
                                        [] {
                                          PlanOptions only_arm;
                                          only_arm.topics = {kGoals};
                                          return only_arm;
                                        }()),
                               fetchLimits());
  EXPECT_EQ(whyTooFast(arm, 1.68), "");
  EXPECT_EQ(whyTooFast(arm, 2),
            kGoals +
                ": velocity of elbow_flex_joint of 1.8 rad/s or m/s at rate 2, 3 s into the "
                "behavior, is above the limit of 1.521")
      << "0.9 rad in a second, whatever the points say of themselves";
}

TEST_F(PlayerRate, refusesABodyOfWhichAMessageIsDamaged) {
  record(kCmdVel, 0, twist(1));
  record(kCloud, 50, cloud(1));
  record(kCmdVel, 100, twist(0));
  play(1000);
  store->damage(1);
  EXPECT_NO_THROW(motionPeaks(*store, plan, fetchLimits())) << "a cloud moves nothing";
  store->damage(2);
  try {
    motionPeaks(*store, plan, fetchLimits());
    FAIL();
  } catch (const StoreError& error) {
    EXPECT_EQ(std::string(error.what())
                  .find("/cmd_vel: 1 of its messages are damaged in the store, "
                        "the first 0.1 s into the behavior"),
              0u)
        << error.what();
  }
}

}  // namespace
}  // namespace afterglow::replay::player_rate_test

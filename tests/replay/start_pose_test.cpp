#include "replay/motion/arm/start_pose.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "replay/motion/arm/approach.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::replay::start_pose_test {
namespace {

using namespace test;

constexpr std::int64_t kMs = 1'000'000, kBegin = 1'600'000'000'000'000'000;

NumberArray numbers(const std::vector<double>& values) {
  NumberArray array{FieldType::Float64, Bytes(values.size() * sizeof(double))};
  if (!values.empty()) std::memcpy(array.bytes.data(), values.data(), array.bytes.size());
  return array;
}

/// A robot with an elbow, a wrist, a torso, a gripper and a base, and what was recorded of it.
struct StartPoseOf : testing::Test {
  void record(const Channel& channel, std::int64_t at_ms, const Bytes& bytes) {
    const std::int64_t id = store->addChannel(recording, channel);
    store->append({{id, {kBegin + at_ms * kMs}, sequence++, {}, bytes}});
  }
  void recordJoints(std::int64_t at_ms, const std::map<std::string, double>& positions) {
    Value message = blank(joints);
    Array names;
    std::vector<double> values;
    for (const auto& [name, position] : positions) {
      names.push_back(name);
      values.push_back(position);
    }
    at(message, "name") = names;
    at(message, "position") = numbers(values);
    record(joints, at_ms, encode(schemaOf(joints), message));
  }
  Bytes armGoal(const std::vector<std::string>& names) const {
    Value goal = decode(schemaOf(arm), goalMessage("recorded", {1.0, 2.0}, {1'600'000'000, 0}));
    at(goal, "goal.trajectory.joint_names") = Array(names.begin(), names.end());
    return encode(schemaOf(arm), goal);
  }
  Bytes gripperGoal(double position) const {
    Value goal = blank(gripper);
    at(goal, "goal.command.position") = position;
    return encode(schemaOf(gripper), goal);
  }
  void recordTransform(std::int64_t at_ms, const std::string& parent, const std::string& child,
                       const PlanarPose& pose) {
    Value entry = blank(schemaOf(tf), "geometry_msgs/TransformStamped");
    const std::int64_t ns = kBegin + at_ms * kMs;
    at(entry, "header.stamp") = RosTime{static_cast<std::uint32_t>(ns / 1'000'000'000),
                                        static_cast<std::uint32_t>(ns % 1'000'000'000)};
    at(entry, "header.frame_id") = parent;
    at(entry, "child_frame_id") = child;
    for (const char* zero : {"translation.z", "rotation.x", "rotation.y"}) {
      at(entry, std::string("transform.") + zero) = 0.0;
    }
    at(entry, "transform.translation.x") = pose.x;
    at(entry, "transform.translation.y") = pose.y;
    at(entry, "transform.rotation.z") = std::sin(pose.yaw / 2);
    at(entry, "transform.rotation.w") = std::cos(pose.yaw / 2);
    Value message = blank(tf);
    at(message, "transforms") = Array{entry};
    record(tf, at_ms, encode(schemaOf(tf), message));
  }

  StartPose read(double start_s = 0) {
    Behavior behavior;
    behavior.recording = recording;
    behavior.name = "reach";
    behavior.begin = {kBegin};
    behavior.end = Stamp{kBegin + 10'000 * kMs};
    behavior.topics = {arm.topic, gripper.topic, drive.topic, command.topic};
    behavior.id = store->addBehavior(behavior);
    PlanOptions options;
    options.start_s = start_s;
    plan = makePlan(*store, behavior, options);
    parts = movedParts(*store, plan);
    remarks.clear();
    return readStartPose(*store, plan, parts, remarks);
  }

  static Approach unchecked() {
    Approach::Rules rules;
    rules.accepts_unchecked = true;
    return Approach({}, {}, rules);
  }

  std::unique_ptr<Store> store = openMemoryStore();
  std::int64_t recording = store->addRecording({0, "", "test", ""});
  std::uint64_t sequence = 0;
  Channel joints = channelOf("/joint_states", "sensor_msgs/JointState",
                             withTypes("Header header\nstring[] name\nfloat64[] position\n"
                                       "float64[] velocity\nfloat64[] effort\n",
                                       "std_msgs/Header", kHeader));
  Channel arm = trajectoryGoalChannel("/arm/follow_joint_trajectory/goal");
  Channel gripper =
      channelOf("/gripper/goal", "control_msgs/GripperCommandActionGoal",
                withTypes("Header header\nactionlib_msgs/GoalID goal_id\nGripperCommandGoal goal\n",
                          "std_msgs/Header", kHeader, "actionlib_msgs/GoalID", kGoalId,
                          "control_msgs/GripperCommandGoal", "GripperCommand command\n",
                          "control_msgs/GripperCommand", "float64 position\nfloat64 max_effort\n"));
  Channel drive = twistChannel("/cmd_vel");
  Channel command =
      channelOf("/arm_controller/command", "trajectory_msgs/JointTrajectory", kBareTrajectory);
  Channel tf = channelOf("/tf", "tf2_msgs/TFMessage", kTfMessage);
  PlayPlan plan;
  MovedParts parts;
  std::vector<std::string> remarks;
};

TEST_F(StartPoseOf, isTheLastThatEachPublisherToldBeforeTheBegin) {
  recordJoints(-300, {{"elbow", 0.1}, {"wrist", 0.2}});
  recordJoints(-200, {{"l_gripper_finger", 0.02}, {"r_gripper_finger", 0.02}});
  recordJoints(-100, {{"elbow", 0.52}, {"wrist", 0.3}});
  recordJoints(50, {{"elbow", 0.9}, {"wrist", 0.9}});
  record(arm, 1000, armGoal({"elbow", "wrist"}));
  const StartPose pose = read();
  EXPECT_EQ(pose.joints, (std::map<std::string, double>{{"elbow", 0.52}, {"wrist", 0.3}}));
  EXPECT_FALSE(pose.base) << "nobody localized it";
  EXPECT_TRUE(remarks.empty());
}

TEST_F(StartPoseOf, isTheFirstAfterTheBeginWhenNothingWasToldBefore) {
  recordJoints(50, {{"elbow", 0.4}});
  recordJoints(100, {{"elbow", 0.9}});
  record(arm, 1000, armGoal({"elbow", "wrist"}));
  EXPECT_EQ(read().joints, (std::map<std::string, double>{{"elbow", 0.4}}));
  EXPECT_EQ(remarks,
            std::vector<std::string>{"the position of wrist at the start was not recorded"});
}

TEST_F(StartPoseOf, hasAnEndWhenTheLastGoalHadBeenReached) {
  recordJoints(0, {{"elbow", 0.1}, {"wrist", 0.2}});
  recordJoints(9'900, {{"elbow", 0.7}});
  recordJoints(11'000, {{"elbow", 1.0}});
  recordJoints(12'000, {{"elbow", 9.0}});
  record(arm, 1000, armGoal({"elbow", "wrist"}));
  read();
  const auto elbowAt = [&](std::int64_t at_ms) {
    remarks.clear();
    return readEndPose(*store, plan, parts, {kBegin + at_ms * kMs}, remarks).joints;
  };
  EXPECT_EQ(elbowAt(10'000), (std::map<std::string, double>{{"elbow", 0.7}}));
  EXPECT_EQ(remarks, std::vector<std::string>{"the position of wrist at the end was not recorded"});
  EXPECT_EQ(elbowAt(11'500).at("elbow"), 1.0);
}

TEST_F(StartPoseOf, hasTheBaseAtItsEndAsFarAsItWasLocalized) {
  record(drive, 1000, twist(0.5));
  for (int i = 0; i <= 100; ++i) recordTransform(i * 100, "odom", "base_link", {i * 0.01, 0, 0.5});
  read();
  EXPECT_FALSE(readEndPose(*store, plan, parts, plan.end, remarks).base);
  EXPECT_EQ(remarks.back(),
            "where the base stood at the end is not known: it was recorded without "
            "localization (map -> odom)");
  for (int i = 0; i <= 10; ++i) recordTransform(i * 1000, "map", "odom", {2, 3, 0});
  read();
  const auto base = readEndPose(*store, plan, parts, plan.end, remarks).base;
  ASSERT_TRUE(base);
  EXPECT_NEAR(base->x, 3, 0.011) << "the part ends before its end";
  EXPECT_NEAR(base->y, 3, 1e-6);
  EXPECT_NEAR(base->yaw, 0.5, 1e-6);
}

TEST_F(StartPoseOf, hasTheBaseThoughTheArmAloneIsMoved) {
  recordJoints(0, {{"elbow", 0.1}, {"wrist", 0.2}});
  record(arm, 1000, armGoal({"elbow", "wrist"}));
  for (int i = -10; i <= 10; ++i) {
    recordTransform(i * 100, "odom", "base_link", {1, 0, 0});
    recordTransform(i * 100, "map", "odom", {2, 3, 0});
  }
  const StartPose then = read();
  ASSERT_TRUE(then.base);
  EXPECT_TRUE(remarks.empty());
  StartPose now = then;
  now.base = PlanarPose{3.08, 3, 0};
  EXPECT_EQ(baseDeviationAtALook(then, now, {}), "") << "as far as a localization may be off";
  now.base = PlanarPose{5, 3, 0};
  EXPECT_EQ(baseDeviationAtALook(then, now, {}),
            "the base is 2.00 m and 0.0 deg off (then 2.00 m behind and 0.00 m to the left, turned "
            "left), where joints lead elsewhere (--start-tolerance base=M base_turn=RAD allows it)");
  now.base.reset();
  EXPECT_EQ(baseDeviationAtALook(then, now, {}),
            "nobody tells where the base is (tf), where joints lead elsewhere (--any-start allows "
            "it)");
}

TEST_F(StartPoseOf, isThatOfTheMomentThePlayedPartBegins) {
  recordJoints(-100, {{"elbow", 0.1}});
  recordJoints(4900, {{"elbow", 0.7}});
  record(arm, 1000, armGoal({"wrist"}));
  record(arm, 6000, armGoal({"elbow"}));
  EXPECT_EQ(read(5).joints, (std::map<std::string, double>{{"elbow", 0.7}}));
}

TEST_F(StartPoseOf, hasTheGripperOnlyIfThatIsMoved) {
  recordJoints(-100, {{"l_gripper_finger", 0.02}, {"elbow", 1}});
  record(gripper, 1000, gripperGoal(0.1));
  EXPECT_EQ(read().joints, (std::map<std::string, double>{{"l_gripper_finger", 0.02}}));
}

TEST_F(StartPoseOf, hasTheBaseOnTheMap) {
  for (std::int64_t ms = -500; ms < 500; ms += 50) {
    recordTransform(ms, "map", "odom", {1, 0, 0});
    recordTransform(ms + 1, "odom", "base_link", {2, 0.5, kPi / 2});
  }
  record(drive, 1000, twist(0.2));
  const StartPose pose = read();
  ASSERT_TRUE(pose.base) << remarks.front();
  EXPECT_NEAR(pose.base->x, 3, 1e-6);
  EXPECT_NEAR(pose.base->y, 0.5, 1e-6);
  EXPECT_NEAR(pose.base->yaw, kPi / 2, 1e-6);
}

TEST_F(StartPoseOf, knowsTheBaseBetterTheMoreLooksLocalizationTookAtIt) {
  for (std::int64_t ms = -4000; ms < 1000; ms += 50) {
    const double off = ms % 500 == 0 ? 0.02 : -0.02;
    recordTransform(ms, "map", "odom", {1 + off, off / 2, off / 4});
    recordTransform(ms + 1, "odom", "base_link", {2, 0.5, 0});
  }
  record(drive, 500, twist(0.2));
  const StartPose pose = read();
  EXPECT_GT(pose.base_share.position, 0.02);
  EXPECT_LT(pose.base_share.position, 0.6);
  EXPECT_GT(pose.base_share.yaw, 0.02);
  EXPECT_LT(pose.base_share.yaw, 0.6);
}

TEST_F(StartPoseOf, hasTheJointsOfTrajectoriesThatAreNoGoals) {
  recordJoints(-100, {{"elbow", 0.4}, {"wrist", 1}});
  Value trajectory = blank(command);
  at(trajectory, "joint_names") = Array{std::string("elbow")};
  record(command, 1000, encode(schemaOf(command), trajectory));
  EXPECT_EQ(read().joints, (std::map<std::string, double>{{"elbow", 0.4}}));
  EXPECT_TRUE(parts.moves_joints);
}

TEST_F(StartPoseOf, takesATopicWithoutMessagesToMoveNothing) {
  record(drive, -1000, twist(0.2));
  record(arm, -1000, armGoal({"elbow"}));
  record(gripper, 1000, gripperGoal(0.1));
  read();
  EXPECT_FALSE(parts.moves_base);
}

TEST_F(StartPoseOf, saysThatTheBaseIsNotKnownWithoutLocalization) {
  for (std::int64_t ms = -500; ms < 500; ms += 50) {
    recordTransform(ms, "odom", "base_link", {2, 0, 0});
  }
  record(drive, 1000, twist(0.2));
  EXPECT_FALSE(read().base);
  EXPECT_EQ(remarks, std::vector<std::string>{
                         "where the base stood at the start is not known: it was recorded without "
                         "localization (map -> odom)"});
}

// -------------------------------------------------------------------------------------- deviations

TEST(StartPose, listsEveryJointThatIsOff) {
  const StartPose then{{{"elbow", 0.52}, {"torso_lift", 0.3}, {"wrist", 3.1}, {"finger", 0.05}},
                       {}};
  const StartPose now{{{"elbow", 0.1}, {"torso_lift", 0.315}, {"wrist", -3.14}, {"head", 1}}, {}};
  EXPECT_EQ(jointDeviations(then, now, {}),
            (std::vector<std::string>{"nobody tells where finger is",
                                      "wrist is 6.24 rad off (now -3.14, then 3.10)",
                                      "elbow is 0.42 rad off (now 0.10, then 0.52)"}))
      << "the torso is near enough";
  EXPECT_EQ(jointDeviations({{{"finger", 0.05}, {"elbow", 0}}, {}},
                            {{{"finger", 0.03}, {"elbow", 0.06}}, {}}, {}),
            (std::vector<std::string>{"finger is 0.020 m off (now 0.030, then 0.050)",
                                      "elbow is 0.06 rad off (now 0.06, then 0.00)"}))
      << "the farthest first, by what each may be off";
  EXPECT_TRUE(jointDeviations({{{"elbow", 0}}, {}}, {{{"elbow", 0.05}}, {}}, {}).empty());
}

TEST(StartPose, refusesInThreeShortClausesHoweverManyJointsAreOff) {
  StartPose then, now;
  for (const char* joint : {"shoulder_pan_joint", "shoulder_lift_joint", "upperarm_roll_joint",
                            "elbow_flex_joint", "forearm_roll_joint", "wrist_flex_joint",
                            "wrist_roll_joint"}) {
    then.joints[joint] = 1.25;
    now.joints[joint] = -1.25;
  }
  then.base = PlanarPose{};
  now.base = PlanarPose{-0.5, -0.3, -0.2};
  const auto joints = jointDeviations(then, now, {});
  EXPECT_EQ(joints.size(), 7u);
  EXPECT_EQ(whyElsewhere(joints, "", false),
            "the robot does not stand as it did: elbow_flex_joint is 2.50 rad off (now -1.25, then "
            "1.25), forearm_roll_joint is 2.50 rad off (now -1.25, then 1.25) and 5 more; "
            "--to-start takes it there");
  const std::string both = whyElsewhere(joints, baseDeviationAtALook(then, now, {}), false);
  EXPECT_LT(both.size(), 290u) << both;
  EXPECT_LT(whyElsewhere(joints, baseDeviation(then, now, {}), true).size(), 250u);
  EXPECT_EQ(whyElsewhere({}, "", true), "");
  EXPECT_NE(whyElsewhere({"elbow is off"}, "the base is off", true).find("elbow is off; the base"),
            std::string::npos)
      << "a single joint is named";
}

TEST(StartPose, saysWhereTheBaseHasToGo) {
  const StartPose then{{}, PlanarPose{1, 1, kPi / 2}};
  EXPECT_EQ(baseDeviation(then, {{}, PlanarPose{1.02, 0.97, kPi / 2 + 0.04}}, {}), "");
  EXPECT_EQ(baseDeviation(then, {{}, PlanarPose{1, 0.5, kPi / 2 - 0.2}}, {}),
            "the base is 0.50 m and 11.5 deg off (then 0.49 m ahead and 0.10 m to the left, turned "
            "left)");
  EXPECT_EQ(
      baseDeviation(then, {{}, PlanarPose{0.6, 1.2, kPi / 2 + 0.1}}, {}),
      "the base is 0.45 m and 5.7 deg off (then 0.24 m behind and 0.38 m to the right, turned "
      "right)");
  const StartPose origin{{}, PlanarPose{}};
  EXPECT_EQ(baseDeviation(origin, {{}, PlanarPose{0.05, 0, 3 / kDegreesPerRadian}}, {}), "");
  EXPECT_NE(baseDeviation(origin, {{}, PlanarPose{0.051, 0, 0}}, {}), "");
  EXPECT_NE(baseDeviation(origin, {{}, PlanarPose{0, 0, 3.1 / kDegreesPerRadian}}, {}), "");
  EXPECT_EQ(baseDeviation(then, {}, {}), "nobody tells where the base is (tf)");
  EXPECT_EQ(baseDeviation({}, {}, {}), "");
}

TEST(StartPose, allowsForWhatLocalizationCannotKnowWithinBounds) {
  const StartTolerances amcl = widened({}, {0.04, 0.03});
  EXPECT_NEAR(amcl.base, 0.09, 1e-9);
  EXPECT_NEAR(amcl.base_turn, StartTolerances().base_turn + 0.03, 1e-9);
  const StartTolerances blind = widened({}, {5, 3});
  EXPECT_NEAR(blind.base, 0.15, 1e-9);
  EXPECT_NEAR(blind.base_turn, StartTolerances().base_turn + 0.1, 1e-9);
}

// ----------------------------------------------------------------------------- the way back there

TEST_F(StartPoseOf, isApproachedSlowlyFromWhereItIsThroughTheActionsOwnGoal) {
  recordJoints(-100, {{"elbow", 0.5}, {"wrist", 0.3}});
  record(arm, 1000, armGoal({"elbow", "wrist"}));
  const StartPose then = read();
  ASSERT_EQ(parts.goals.size(), 1u);
  const StartPose now{{{"elbow", -0.7}, {"wrist", 0.3}}, {}};
  const Approach approach = unchecked();
  const auto found = startGoal(parts.goals[0], then, now, {}, approach, {kBegin}, "fresh");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->kind, JointWay::Kind::Unchecked);
  const Bytes& bytes = found->bytes;
  Value goal = decode(schemaOf(arm), bytes);
  EXPECT_EQ(goalId(bytes), "fresh");
  EXPECT_EQ(stampOf(goal, "goal_id.stamp").ns, 0);
  EXPECT_EQ(trajectoryStamp(bytes).ns, 0) << "now";
  EXPECT_EQ(timesFromStart(bytes), (std::vector<double>{0, 6}))
      << "1.2 rad at 0.3 rad/s where it is fastest";
  Array& points = std::get<Array>(at(goal, "goal.trajectory.points"));
  EXPECT_EQ(numbersOf(at(points.front(), "positions")), (std::vector<double>{-0.7, 0.3}));
  Value point = points.back();
  EXPECT_EQ(numbersOf(at(point, "positions")), (std::vector<double>{0.5, 0.3}));
  EXPECT_EQ(numbersOf(at(point, "velocities")), (std::vector<double>{0, 0}));
  EXPECT_FALSE(startGoal(parts.goals[0], then, then, {}, approach, {kBegin}, "fresh"))
      << "it is there";
  EXPECT_FALSE(startGoal(parts.goals[0], then, {}, {}, approach, {kBegin}, "fresh"))
      << "nobody knows where it is";
}

TEST_F(StartPoseOf, isApproachedByTheGrippersGap) {
  recordJoints(-100, {{"l_gripper_finger", 0.02}, {"r_gripper_finger", 0.03}});
  record(gripper, 1000, gripperGoal(0.1));
  const StartPose then = read();
  const StartPose open{{{"l_gripper_finger", 0.05}, {"r_gripper_finger", 0.05}}, {}};
  const auto found =
      startGoal(parts.goals.at(0), then, open, {}, unchecked(), {kBegin}, "fresh");
  ASSERT_TRUE(found);
  Value goal = decode(schemaOf(gripper), found->bytes);
  EXPECT_DOUBLE_EQ(std::get<double>(at(goal, "goal.command.position")), 0.05);
  EXPECT_FALSE(startGoal(parts.goals.at(0), then, then, {}, unchecked(), {kBegin}, "fresh"))
      << "it is as wide already";
}

}  // namespace
}  // namespace afterglow::replay::start_pose_test

#include "replay/plan/rewrite.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/support/document_fields.hpp"
#include "tests/support/message_definitions.hpp"

namespace afterglow::replay::rewrite_test {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

/// Recorded at 100 s, published at 5000 s: stamps move by 4900 s. Fresh ids are "new-1", "new-2",
/// ...
class RewriteTest : public testing::Test {
 protected:
  static Channel channel(const std::string& topic, const std::string& type,
                         const std::string& definition) {
    return {topic, type, "0123456789abcdef0123456789abcdef", definition, false, "/recorded"};
  }

  Rewritten rewrite(const Channel& on, Bytes& bytes) { return rewriter_.rewrite(on, now_, bytes); }

  /// A trajectory goal, stamped at 100 s as its recorded sender did.
  Bytes trajectoryGoal(const std::string& id, RosTime trajectory_start) const {
    Value goal = test::zeroDocument(goal_schema_);
    replay::valueAt(goal, "header.stamp") = RosTime{100, 1};
    replay::valueAt(goal, "header.seq") = std::uint32_t{7};
    replay::valueAt(goal, "goal_id.stamp") = RosTime{100, 2};
    replay::valueAt(goal, "goal_id.id") = id;
    replay::valueAt(goal, "goal.trajectory.header.stamp") = trajectory_start;
    replay::valueAt(goal, "goal.trajectory.joint_names") = Array{std::string("elbow_flex_joint")};
    replay::valueAt(goal, "goal.goal_time_tolerance") = RosDuration{5, 0};
    return encode(goal_schema_, goal);
  }

  Bytes cancel(const std::string& id, RosTime stamp) const {
    return encode(cancel_schema_, Object{{"stamp", stamp}, {"id", id}});
  }

  const Channel goals_ =
      channel("/arm/follow_joint_trajectory/goal", "control_msgs/FollowJointTrajectoryActionGoal",
              test::kTrajectoryActionGoal);
  const Channel cancels_ =
      channel("/arm/follow_joint_trajectory/cancel", "actionlib_msgs/GoalID", test::kGoalId);
  const Schema goal_schema_ = Schema::parse(goals_.type, goals_.definition);
  const Schema cancel_schema_ = Schema::parse(cancels_.type, cancels_.definition);
  PublishMoment now_{{5000 * kSecond}, 4900 * kSecond};
  int ids_ = 0;
  Rewriter rewriter_{[this] { return "new-" + std::to_string(++ids_); }};
};

TEST_F(RewriteTest, shiftsEveryStampButZero) {
  const Channel tf = channel("/shown_tf", "tf2_msgs/TFMessage", test::kTfMessage);
  const Schema schema = Schema::parse(tf.type, tf.definition);
  Bytes bytes(4 + 2 * schema.minimumSize(1));
  bytes[0] = 2;
  writeTime(bytes, findField(schema, bytes, FieldPath::parse("transforms[1].header.stamp")).at(0),
            {100 * kSecond + 5});
  EXPECT_TRUE(rewrite(tf, bytes).publish);
  EXPECT_EQ(test::stampsAt(schema, bytes, "transforms[].header.stamp"),
            (std::vector<std::int64_t>{0, 5000 * kSecond + 5}));
}

TEST_F(RewriteTest, leavesStampsWhereTimeIsReplayedToo) {
  now_.shift_ns = 0;
  const Channel times = channel("/t", "std_msgs/Time", "time data\n");
  Bytes bytes = {7, 0, 0, 0, 255, 255, 255, 255};  // even one with too many nanoseconds
  const Bytes before = bytes;
  EXPECT_TRUE(rewrite(times, bytes).publish);
  EXPECT_EQ(bytes, before);
}

TEST_F(RewriteTest, givesAGoalAFreshIdAndTheTimeOfPublishing) {
  Bytes bytes = trajectoryGoal("/task-1-100.000", {0, 0});
  const Rewritten result = rewrite(goals_, bytes);
  EXPECT_TRUE(result.publish);
  ASSERT_TRUE(result.goal);
  EXPECT_EQ(*result.goal, "new-1");
  Value expected = decode(goal_schema_, trajectoryGoal("new-1", {0, 0}));
  replay::valueAt(expected, "header.stamp") = RosTime{5000, 0};
  replay::valueAt(expected, "goal_id.stamp") = RosTime{5000, 0};
  EXPECT_EQ(bytes, encode(goal_schema_, expected));
}

TEST_F(RewriteTest, givesTheSameGoalAnotherIdEachTime) {
  for (const std::string expected : {"new-1", "new-2"}) {
    Bytes bytes = trajectoryGoal("/task-1-100.000", {0, 0});
    EXPECT_EQ(*rewrite(goals_, bytes).goal, expected);
    EXPECT_EQ(test::stringAt(goal_schema_, bytes, "goal_id.id"), expected);
  }
}

TEST_F(RewriteTest, letsNoStaleTrajectoryStampSurvive) {
  Bytes goal = trajectoryGoal("a", {100, 3});
  EXPECT_TRUE(rewrite(goals_, goal).publish);
  EXPECT_EQ(test::stampsAt(goal_schema_, goal, "goal.trajectory.header.stamp"),
            std::vector<std::int64_t>{0});
  const Channel commands =
      channel("/arm_controller/command", "trajectory_msgs/JointTrajectory", test::kBareTrajectory);
  const Schema schema = Schema::parse(commands.type, commands.definition);
  Value trajectory = test::zeroDocument(schema);
  replay::valueAt(trajectory, "header.stamp") = RosTime{100, 0};
  Bytes bytes = encode(schema, trajectory);
  EXPECT_TRUE(rewrite(commands, bytes).publish);
  EXPECT_EQ(headerStamp(schema, bytes), Stamp{0});
}

TEST_F(RewriteTest, shiftsTheStampsInAGoal) {
  const Channel heads = channel("/head_controller/point_head/goal",
                                "control_msgs/PointHeadActionGoal", test::kPointHeadActionGoal);
  const Schema schema = Schema::parse(heads.type, heads.definition);
  Value goal = test::zeroDocument(schema);
  replay::valueAt(goal, "goal.target.header.stamp") = RosTime{99, 0};
  Bytes bytes = encode(schema, goal);
  EXPECT_TRUE(rewrite(heads, bytes).publish);
  EXPECT_EQ(test::stampsAt(schema, bytes, "goal.target.header.stamp"),
            std::vector<std::int64_t>{4999 * kSecond});
  EXPECT_EQ(test::stampsAt(schema, bytes, "header.stamp"),
            std::vector<std::int64_t>{5000 * kSecond});
}

TEST_F(RewriteTest, cancelsAGoalByTheIdItWasSentWith) {
  Bytes goal = trajectoryGoal("a", {0, 0});
  EXPECT_TRUE(rewrite(goals_, goal).publish);
  Bytes bytes = cancel("a", {0, 0});
  EXPECT_TRUE(rewrite(cancels_, bytes).publish);
  EXPECT_EQ(bytes, cancel("new-1", {0, 0}));
}

TEST_F(RewriteTest, doesNotPublishTheCancelOfAGoalItDidNotSend) {
  Bytes bytes = cancel("a", {0, 0});
  EXPECT_FALSE(rewrite(cancels_, bytes).publish);
}

TEST_F(RewriteTest, narrowsACancelOfEverybodysGoalsToItsOwn) {
  Bytes early = cancel("", {0, 0});
  EXPECT_FALSE(rewrite(cancels_, early).publish) << "nothing of it is there to cancel";
  Bytes goal = trajectoryGoal("a", {0, 0});
  EXPECT_TRUE(rewrite(goals_, goal).publish);
  Bytes bytes = cancel("", {0, 0});
  EXPECT_TRUE(rewrite(cancels_, bytes).publish);
  EXPECT_EQ(bytes, cancel("new-1", {0, 0}));
  const Channel others = channel("/torso/follow_joint_trajectory/cancel", cancels_.type,
                                 test::kGoalId);
  Bytes other = cancel("", {0, 0});
  EXPECT_FALSE(rewrite(others, other).publish) << "another action's";
}

TEST_F(RewriteTest, narrowsACancelUpToAStampToItsGoalIfThatWasCoveredThen) {
  Bytes goal = trajectoryGoal("a", {0, 0});
  EXPECT_TRUE(rewrite(goals_, goal).publish);
  Bytes covering = cancel("", {100, 2});
  EXPECT_TRUE(rewrite(cancels_, covering).publish);
  EXPECT_EQ(covering, cancel("new-1", {0, 0}));
  Bytes before = cancel("", {99, 1});
  EXPECT_FALSE(rewrite(cancels_, before).publish);
  Bytes unknown = cancel("unknown", {101, 0});
  EXPECT_TRUE(rewrite(cancels_, unknown).publish);
  EXPECT_EQ(unknown, cancel("new-1", {0, 0}));
}

TEST_F(RewriteTest, refusesStampsThatLeaveRosTime) {
  const Channel times = channel("/t", "std_msgs/Time", "time data\n");
  Bytes late = {255, 255, 255, 255, 0, 0, 0, 0};
  EXPECT_THROW(static_cast<void>(rewrite(times, late)), MessageError);
  now_.shift_ns = -200 * kSecond;
  Bytes early = {100, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_THROW(static_cast<void>(rewrite(times, early)), MessageError);
  now_.shift_ns = std::numeric_limits<std::int64_t>::min();
  EXPECT_THROW(static_cast<void>(rewrite(times, early)), MessageError);
}

TEST_F(RewriteTest, refusesBytesThatDoNotFit) {
  Bytes bytes = trajectoryGoal("a", {0, 0});
  bytes.pop_back();
  EXPECT_THROW(static_cast<void>(rewrite(goals_, bytes)), MessageError);
  EXPECT_EQ(ids_, 0);
}

TEST_F(RewriteTest, leavesMessagesWithoutStampsAlone) {
  const Channel strings = channel("/s", "std_msgs/String", "string data\n");
  EXPECT_TRUE(rewriter_.rules(strings).empty());
  Bytes bytes = {1, 0, 0, 0, 'a'};
  EXPECT_TRUE(rewrite(strings, bytes).publish);
  EXPECT_EQ(bytes, (Bytes{1, 0, 0, 0, 'a'}));
}

TEST_F(RewriteTest, saysWhatItDoes) {
  std::map<std::string, std::string> rules;
  for (const RewrittenField& field : rewriter_.rules(goals_)) {
    rules[field.path] = describe(field.rule);
  }
  EXPECT_EQ(rules, (std::map<std::string, std::string>{
                       {"header.stamp", "set to the time of publishing"},
                       {"goal_id.stamp", "set to the time of publishing"},
                       {"goal_id.id", "replaced by a fresh id"},
                       {"goal.trajectory.header.stamp", "zeroed: starts on arrival"}}));
}

TEST_F(RewriteTest, followsAnotherDefinitionOfTheSameType) {
  const Channel old_type = channel("/t", "a/Stamped", "time stamp\n");
  const Channel new_type = channel("/t", "a/Stamped", "int8 version\ntime stamp\n");
  Bytes old_bytes = {100, 0, 0, 0, 0, 0, 0, 0};
  Bytes new_bytes = {1, 100, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_TRUE(rewrite(old_type, old_bytes).publish);
  EXPECT_TRUE(rewrite(new_type, new_bytes).publish);
  EXPECT_EQ(old_bytes, (Bytes{0x88, 0x13, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(new_bytes, (Bytes{1, 0x88, 0x13, 0, 0, 0, 0, 0, 0}));
}

TEST_F(RewriteTest, takesNoGoalForOneThatOnlyBearsTheName) {
  const Channel odd = channel("/t", "a/OddActionGoal", "Header header\nint8 goal_id\nint8 goal\n");
  for (const RewrittenField& field : rewriter_.rules(odd)) {
    EXPECT_EQ(field.rule, RewriteRule::ShiftStamp) << field.path;
  }
}

TEST(UniqueGoalIds, neverRepeat) {
  const Rewriter::FreshId first = uniqueGoalIds("/player"), second = uniqueGoalIds("/player");
  std::set<std::string> ids;
  for (int i = 0; i < 100; ++i) {
    ids.insert(first());
    ids.insert(second());
  }
  EXPECT_EQ(ids.size(), 200u);
  EXPECT_EQ(ids.begin()->substr(0, 8), "/player-");
}

// -------------------------------------------------------------------------------------- settings

TEST_F(RewriteTest, renamesFramesOfNestedHeadersAndChildren) {
  const Channel tf = channel("/shown_tf", "tf2_msgs/TFMessage", test::kTfMessage);
  const Schema schema = Schema::parse(tf.type, tf.definition);
  Bytes bytes(4 + 2 * schema.minimumSize(1));
  bytes[0] = 2;
  const auto name = [&](const char* path, const std::string& text) {
    editStrings(schema, bytes, FieldPath::parse(path), [&](const std::string&) { return text; });
  };
  name("transforms[0].header.frame_id", "/map");
  name("transforms[0].child_frame_id", "base_link");
  name("transforms[1].child_frame_id", "odom");
  RewriteSettings settings;
  settings.frames = {{"map", "hall"}};
  settings.tf_prefix = "robot2";
  Rewriter rewriter([] { return ""; }, settings);
  EXPECT_TRUE(rewriter.rewrite(tf, now_, bytes).publish);
  std::vector<std::string> frames;
  for (const char* path : {"transforms[].header.frame_id", "transforms[].child_frame_id"}) {
    for (const FieldSpan& span : findField(schema, bytes, FieldPath::parse(path))) {
      frames.push_back(readString(bytes, span));
    }
  }
  EXPECT_EQ(frames, (std::vector<std::string>{"hall", "", "robot2/base_link", "robot2/odom"}));
  const auto rules = rewriter.rules(tf);
  ASSERT_EQ(rules.size(), 3u);
  EXPECT_EQ(rules[0].path, "transforms[].header.stamp");
  EXPECT_EQ(rules[0].count, 0u) << "zero stamps are kept";
  EXPECT_EQ(rules[1].count, 1u);
  EXPECT_EQ(rules[2].count, 2u);
}

TEST_F(RewriteTest, followsRulesForTypesItDoesNotKnowWhereverTheyAreNested) {
  const Channel plans =
      channel("/plan", "my_msgs/Plans",
              test::withTypes("Plan[] plans\n", "my_msgs/Plan",
                              "time made\ntime due\ntime read\nduration[2] waits\nstring id\n"));
  const Schema schema = Schema::parse(plans.type, plans.definition);
  Value plan = Object{{"made", RosTime{100, 0}},
                      {"due", RosTime{101, 0}},
                      {"read", RosTime{102, 0}},
                      {"waits", Array{RosDuration{1, 0}, RosDuration{2, 0}}},
                      {"id", std::string("a")}};
  Bytes bytes = encode(schema, Object{{"plans", Array{plan, plan}}});
  RewriteSettings settings;
  settings.rules["my_msgs/Plan"] = {{"made", RewriteRule::Keep},
                                    {"due", RewriteRule::PublishStamp},
                                    {"waits[]", RewriteRule::Zero},
                                    {"id", RewriteRule::FreshId}};
  int fresh = 0;
  Rewriter rewriter([&] { return "id-" + std::to_string(++fresh); }, settings);
  EXPECT_TRUE(rewriter.rewrite(plans, now_, bytes).publish);
  EXPECT_EQ(test::stampsAt(schema, bytes, "plans[].made"),
            (std::vector<std::int64_t>{100 * kSecond, 100 * kSecond}));
  EXPECT_EQ(test::stampsAt(schema, bytes, "plans[].due")[0], 5000 * kSecond);
  EXPECT_EQ(test::stampsAt(schema, bytes, "plans[].read")[1], 5002 * kSecond);
  EXPECT_EQ(test::stringAt(schema, bytes, "plans[0].id"), "id-1");
  EXPECT_EQ(test::stringAt(schema, bytes, "plans[1].id"), "id-1") << "the same stays the same";
  for (const FieldSpan& span : findField(schema, bytes, FieldPath::parse("plans[].waits[]"))) {
    EXPECT_EQ(bytes[span.offset], 0);
  }
}

TEST(RewriteRules, renameFramesAloneAmongTexts) {
  const Schema schema = Schema::parse(
      "my_msgs/Said", test::withTypes("Header header\nstring text\nstring child_frame_id\n"
                                      "string frame_id\n",
                                      "std_msgs/Header", test::kHeader));
  RewriteSettings settings;
  settings.tf_prefix = "robot2";
  std::vector<std::string> renamed;
  for (const RewrittenField& field : rewriteRules(schema, settings)) {
    if (field.rule == RewriteRule::RemapFrame) renamed.push_back(field.path);
  }
  EXPECT_EQ(renamed, (std::vector<std::string>{"header.frame_id", "child_frame_id"}));
}

TEST(RewriteRule, isKnownByItsWordAlone) {
  EXPECT_EQ(parseRule("shift"), RewriteRule::ShiftStamp);
  EXPECT_EQ(parseRule("now"), RewriteRule::PublishStamp);
  EXPECT_EQ(parseRule("remap_frame"), RewriteRule::RemapFrame);
  EXPECT_FALSE(parseRule("fresh_goal_id"));
  EXPECT_FALSE(parseRule(""));
}

TEST_F(RewriteTest, refusesRulesThatFitNoField) {
  const auto refusal = [&](const std::string& path, RewriteRule rule) -> std::string {
    RewriteSettings settings;
    settings.rules["std_msgs/Header"] = {{path, rule}};
    try {
      rewriteRules(goal_schema_, settings);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal("stmap", RewriteRule::Keep),
            "a rewriting rule names goal.trajectory.header.stmap, which "
            "control_msgs/FollowJointTrajectoryActionGoal has not");
  EXPECT_NE(refusal("seq", RewriteRule::ShiftStamp).find("is not for a uint32"), std::string::npos);
  EXPECT_NE(refusal("stamp", RewriteRule::FreshId).find("is not for a time"), std::string::npos);
  EXPECT_EQ(refusal("stamp", RewriteRule::Keep), "");
}

}  // namespace
}  // namespace afterglow::replay::rewrite_test

// The conditions of motion, as far as the graph and the recording tell them: no master is asked.
#include "nodes/player/body_gate.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "nodes/player/robot_services.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/messages.hpp"

namespace afterglow::nodes::body_gate_test {
namespace {

using Texts = std::vector<std::string>;

replay::PlannedTopic moving(const replay::Channel& channel) {
  replay::PlannedTopic topic;
  topic.channel = topic.output = channel;
  topic.modality = replay::Modality::Body;
  return topic;
}

const replay::Channel kGoals = test::trajectoryGoalChannel("/arm/follow/goal");

/// A base and an arm are played, and all that they need is there.
struct Robot {
  Robot() {
    plan.topics = {moving(test::twistChannel("/cmd_vel")), moving(kGoals)};
    graph.subscribers = {{"/cmd_vel", {"/base"}}, {"/arm/follow/goal", {"/arm"}}};
    graph.publishers = {{"/arm/follow/status", {"/arm"}}};
  }
  Texts missing() const { return missingControllers(plan, {}, graph); }

  replay::PlayPlan plan;
  RosGraph graph;
};

TEST(MissingControllers, areNoneWhereAllThatIsPlayedIsHeardAndServed) {
  EXPECT_EQ(Robot().missing(), Texts{});
}

TEST(MissingControllers, areActionServersThatDoNotHearOrDoNotAnswer) {
  Robot deaf, mute;
  deaf.graph.subscribers.erase("/arm/follow/goal");
  EXPECT_EQ(deaf.missing(), Texts{"there is no action server /arm/follow"});
  mute.graph.publishers.clear();
  EXPECT_EQ(mute.missing(), Texts{"there is no action server /arm/follow"});
}

TEST(MissingControllers, areListenersOfVelocities) {
  Robot robot;
  robot.graph.subscribers.erase("/cmd_vel");
  EXPECT_EQ(robot.missing(), Texts{"nobody listens on /cmd_vel"});
  robot.plan.topics[0].is_for_start = true;
  EXPECT_EQ(robot.missing(), Texts{}) << "it is only needed if the base is off";
  robot.plan.topics[0].is_for_start = false;
  robot.plan.topics[0].why_not = "it was excluded";
  EXPECT_EQ(robot.missing(), Texts{});
  robot.plan.topics[0].why_not.clear();
  robot.plan.topics[0].modality = replay::Modality::Ar;
  EXPECT_EQ(robot.missing(), Texts{}) << "light moves nothing";
}

TEST(MissingControllers, areListenersOfTheCancelThatStopsATarget) {
  Robot robot;
  replay::PlannedTopic target =
      moving(test::channelOf("/move_base_simple/goal", "geometry_msgs/PoseStamped",
                             test::withTypes("Header header\n", "std_msgs/Header", test::kHeader)));
  target.rule_stop.kind = replay::StopKind::Cancel;
  target.rule_stop.cancel_topic = "/move_base/cancel";
  target.rule_stop.rule = "rules.yaml:1";
  robot.plan.topics = {target};
  robot.graph.subscribers["/move_base_simple/goal"] = {"/move_base"};
  EXPECT_EQ(robot.missing(),
            Texts{"nobody listens on /move_base/cancel, which is to stop /move_base_simple/goal"});
  robot.graph.subscribers["/move_base/cancel"] = {"/move_base"};
  EXPECT_EQ(robot.missing(), Texts{});
}

TEST(MissingControllers, areWatchesOfRobotsOfRos2) {
  Robot robot;
  robot.graph.publishers["/base/ros2_network"] = {"/base"};
  ASSERT_EQ(robot.missing().size(), 1u);
  EXPECT_EQ(robot.missing()[0].find("/cmd_vel goes to a robot of ROS 2 over /base"), 0u);
}

TEST(Controllers, obeyOnlyWhileTheyRun) {
  const ControllerStates states = {
      {"/arm", "stopped"}, {"/base", "running"}, {"/robot2/arm", "initialized"}};
  EXPECT_EQ(whyNotRunning(states, "/arm/follow/goal"),
            "arm is stopped (controller_manager): start it with `rosrun controller_manager "
            "controller_manager start arm`");
  EXPECT_EQ(whyNotRunning(states, "/base/command"), "");
  EXPECT_EQ(whyNotRunning(states, "/arm_2/follow/goal"), "") << "that is another one";
  EXPECT_EQ(whyNotRunning(states, "/arm"), "");
  EXPECT_EQ(whyNotRunning(states, "/robot2/arm/follow/goal"),
            "robot2/arm is initialized (controller_manager): start it with "
            "`ROS_NAMESPACE=/robot2 rosrun controller_manager controller_manager start arm`");
}

TEST(BodyGate, knowsThatTheBaseIsMovedIfItIsOnlyTakenToTheStart) {
  replay::PlayPlan plan;
  plan.topics = {moving(kGoals)};
  replay::MovedParts parts;
  EXPECT_FALSE(movesBase(plan, parts));
  plan.topics[0].is_for_start = true;
  EXPECT_TRUE(movesBase(plan, parts));
  plan.topics[0].is_for_start = false;
  parts.moves_base = true;
  EXPECT_TRUE(movesBase(plan, parts));
}

TEST(BodyGate, refusesWhatCannotBeComparedUnlessItMayStartAnywhere) {
  replay::MovedParts parts;
  BodyOptions options;
  EXPECT_EQ(whyUnnamed(parts, options), "");
  parts.unnamed = {"/a", "/b"};
  EXPECT_EQ(whyUnnamed(parts, options).find("what /a, /b moves is not told by its messages"), 0u);
  options.start = BodyOptions::Start::MoveThere;
  EXPECT_NE(whyUnnamed(parts, options), "");
  options.start = BodyOptions::Start::Anywhere;
  EXPECT_EQ(whyUnnamed(parts, options), "");
}

TEST(BodyGate, missesJointsThatNobodyTellsOf) {
  replay::MovedParts parts;
  parts.goals = {{kGoals, {}, {"elbow", "wrist"}}};
  replay::StartPose now;
  now.joints = {{"elbow", 0.0}};
  EXPECT_EQ(whyNoJoints({}, parts, now), "this robot has no joint wrist (/joint_states)");
  now.joints["wrist"] = 1;
  EXPECT_EQ(whyNoJoints({}, parts, now), "");
}

TEST(BodyGate, comparesNothingWhereItMayStartAnywhere) {
  const auto store = replay::openMemoryStore();
  replay::Message message;
  const std::int64_t recording = store->addRecording({0, "", "test", ""});
  message.channel = store->addChannel(recording, kGoals);
  message.received = {700'000'000};
  message.bytes = test::goalMessage("id", {1});
  store->append({message});
  replay::PlayPlan plan;
  plan.behavior.recording = recording;
  plan.behavior.end = plan.end = replay::Stamp{1'000'000'000};
  plan.topics = {moving(kGoals)};
  replay::MovedParts parts;
  parts.goals = {{kGoals, message.bytes, {"elbow"}}};
  parts.moves_joints = true;
  BodyOptions options;
  Texts remarks;
  startToCompare(*store, plan, options, parts, nullptr, remarks);
  EXPECT_FALSE(remarks.empty()) << "where the elbow was is not known";
  options.start = BodyOptions::Start::Anywhere;
  remarks.clear();
  startToCompare(*store, plan, options, parts, nullptr, remarks);
  EXPECT_EQ(remarks, Texts{});
}

}  // namespace
}  // namespace afterglow::nodes::body_gate_test

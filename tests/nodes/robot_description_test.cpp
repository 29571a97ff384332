// A robot's joints by its description, and who tells where they are.
#include "nodes/player/robot_description.hpp"

#include <gtest/gtest.h>

#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/messages.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::robot_description_test {
namespace {

using replay::RobotJoints;

const std::string kLift =
    "<robot name='lift'><link name='a'/><link name='b'/><link name='c'/><link name='d'/>"
    "<joint name='up' type='prismatic'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/>"
    "<limit lower='0' upper='1' effort='1' velocity='0.1'/></joint>"
    "<joint name='turn' type='continuous'><parent link='b'/><child link='c'/></joint>"
    "<joint name='bellows' type='prismatic'><parent link='b'/><child link='d'/>"
    "<axis xyz='0 0 1'/><limit lower='0' upper='1' effort='1' velocity='0.1'/>"
    "<mimic joint='up' multiplier='0.5' offset='0.2'/></joint></robot>";

TEST(RobotDescription, tellsTypesLimitsAndWhoFollowsWhom) {
  const RobotJoints joints = readRobotJoints(kLift, {});
  EXPECT_EQ(joints.robotName(), "lift");
  EXPECT_TRUE(joints.isSliding("up"));
  EXPECT_EQ(joints.all().at("up").fastest, 0.1);
  EXPECT_TRUE(joints.isEndless("turn"));
  EXPECT_FALSE(joints.all().at("turn").fastest) << "it has no limit";
  ASSERT_TRUE(joints.mimicOf("bellows"));
  EXPECT_EQ(joints.mimicOf("bellows")->other, "up");
  EXPECT_EQ(joints.mimicOf("bellows")->factor, 0.5);
  EXPECT_EQ(joints.mimicOf("bellows")->offset, 0.2);
}

TEST(RobotDescription, hasARangeWhereItRisesAndASpeedAboveZero) {
  const auto jointOf = [](const std::string& type, const std::string& limits) {
    const std::string urdf =
        "<robot name='arm'><link name='a'/><link name='b'/><joint name='j' type='" + type +
        "'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/><limit " + limits +
        " effort='1'/></joint></robot>";
    return readRobotJoints(urdf, {}).all().at("j");
  };
  EXPECT_EQ(jointOf("revolute", "lower='-1' upper='2' velocity='0.5'").range,
            (replay::JointRange{-1, 2}));
  EXPECT_FALSE(jointOf("revolute", "lower='1' upper='1' velocity='0.5'").range);
  EXPECT_TRUE(jointOf("prismatic", "lower='0' upper='0.4' velocity='0.5'").range);
  EXPECT_FALSE(jointOf("continuous", "lower='-1' upper='2' velocity='0.5'").range);
  EXPECT_EQ(jointOf("continuous", "velocity='0.5'").fastest, 0.5);
  EXPECT_FALSE(jointOf("revolute", "lower='-1' upper='2' velocity='0'").fastest);
  EXPECT_EQ(jointOf("revolute", "lower='-1' upper='2' velocity='1'").kind,
            replay::RobotJoint::Kind::Turning);
}

TEST(RobotDescription, tellsNothingIfItIsNone) {
  EXPECT_FALSE(readRobotJoints("", {}).isDescribed());
  EXPECT_FALSE(readRobotJoints("<robot", {}).isDescribed());
}

TEST(RobotDescription, isTheRecordedOne) {
  const auto store = replay::openMemoryStore();
  store->addFile("cd", {kLift.begin(), kLift.end()});
  replay::Behavior behavior;
  EXPECT_FALSE(recordedJoints(*store, behavior, {}).isDescribed()) << "of before";
  replay::Snapshot snapshot;
  snapshot.urdf = "cd";
  behavior.snapshot = snapshot.toJson();
  EXPECT_TRUE(recordedJoints(*store, behavior, {}).isSliding("up"));
  snapshot.urdf = "lost";
  behavior.snapshot = snapshot.toJson();
  EXPECT_FALSE(recordedJoints(*store, behavior, {}).isDescribed());
}

TEST(RobotDescription, jointsAreHeardWhereTheyWereRecordedUnderTheReplaysNames) {
  const auto store = replay::openMemoryStore();
  replay::Behavior behavior;
  behavior.recording = store->addRecording({0, "", "test", ""});
  behavior.end = replay::Stamp{10};
  const std::string type = "sensor_msgs/JointState", usual = "/joint_states";
  EXPECT_EQ(recordedTopics(*store, behavior, {type}, usual), std::vector<std::string>{usual});
  for (const char* topic : {"/fetch7/joint_states", "/fetch7/commands"}) {
    const std::int64_t channel =
        store->addChannel(behavior.recording, test::channelOf(topic, type, "string[] name\n"));
    store->append({{channel, {5}, 0, {}, {0, 0, 0, 0}}});
  }
  const std::int64_t lamps =
      store->addChannel(behavior.recording, test::textChannel("/lamp/joint_states"));
  store->append({{lamps, {5}, 0, {}, {0, 0, 0, 0}}});
  const std::string recorded = "/fetch7/joint_states";
  EXPECT_EQ(recordedTopics(*store, behavior, {type}, usual), std::vector<std::string>{recorded});
  replay::PlayPlan plan;
  replay::PlanOptions names;
  EXPECT_EQ(liveName(plan, names, recorded), recorded);
  names.prefix = "/then";
  EXPECT_EQ(liveName(plan, names, recorded), "/then/fetch7/joint_states");
  names.remap.emplace(recorded, "/robot2/joint_states");
  EXPECT_EQ(liveName(plan, names, recorded), "/robot2/joint_states");
  plan.topics.emplace_back();
  plan.topics.back().channel.topic = recorded;
  EXPECT_EQ(liveName(plan, names, recorded), recorded) << "it would hear itself";
}

}  // namespace
}  // namespace afterglow::nodes::robot_description_test

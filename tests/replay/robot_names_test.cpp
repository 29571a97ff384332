// The names of a robot that is one of several, and of a recorded one on today's.
#include "replay/messages/topic_name.hpp"

#include <gtest/gtest.h>

#include <set>

#include "replay/record/snapshot.hpp"

namespace afterglow::replay::robot_names_test {
namespace {

using Frames = std::set<std::string>;

RobotNames found(const std::string& name_space, const std::string& said, const Frames& frames) {
  return findRobotNames(name_space, said,
                        [&](const std::string& frame) { return frames.count(frame) > 0; });
}

TEST(RobotNames, aRobotAmongSeveralHasItsTopicsInItsNamespaceButForThoseThatAllShare) {
  const RobotNames robot{"/robot1", "robot1"};
  EXPECT_EQ(robot.topic("/odom"), "/robot1/odom");
  EXPECT_EQ(robot.topic("odom"), "/robot1/odom");
  EXPECT_EQ(robot.topic("/robot1/odom"), "/robot1/odom");
  EXPECT_EQ(robot.topic("/robot10/odom"), "/robot1/robot10/odom") << "no prefix of a name";
  EXPECT_EQ(robot.topic("/tf"), "/tf");
  EXPECT_EQ(robot.topic("/map"), "/map");
  EXPECT_EQ(robot.topic(""), "");
  EXPECT_EQ(RobotNames().topic("/odom"), "/odom");
}

TEST(RobotNames, aRobotAmongSeveralHasItsPrefixBeforeItsFramesButNotBeforeTheWorlds) {
  const RobotNames robot{"/robot1", "robot1_tf"};
  EXPECT_EQ(robot.frame("base_link"), "robot1_tf/base_link");
  EXPECT_EQ(robot.frame("/base_link"), "robot1_tf/base_link");
  EXPECT_EQ(robot.frame("robot1_tf/base_link"), "robot1_tf/base_link");
  EXPECT_EQ(robot.frame("map"), "map");
  EXPECT_EQ(robot.frame(""), "");
  EXPECT_EQ(RobotNames({"/robot1", ""}).frame("base_link"), "base_link");
}

TEST(RobotNames, aNamespaceIsCleanHoweverItIsWritten) {
  for (const char* text : {"robot1", "/robot1", "/robot1/", "//robot1"}) {
    EXPECT_EQ(cleanNamespace(text), "/robot1") << text;
  }
  for (const char* text : {"", "/", "//"}) EXPECT_EQ(cleanNamespace(text), "") << text;
}

TEST(RobotNames, thePrefixIsTheOneThatTfKnows) {
  EXPECT_EQ(found("/robot1", "", {"robot1/base_link"}).frame_prefix, "robot1");
  EXPECT_EQ(found("/robot1", "", {"robot1_tf/base_footprint"}).frame_prefix, "robot1_tf");
  EXPECT_EQ(found("/robot1", "first", {"first/base_link", "map"}).frame_prefix, "first");
  EXPECT_EQ(found("/robot1", "", {"robot2/base_link"}).frame_prefix, "") << "another robot's";
  EXPECT_EQ(found("/robot1", "robot1", {"base_link"}).frame_prefix, "") << "said, but not so";
  EXPECT_EQ(found("/robot1", "robot1", {}).frame_prefix, "robot1") << "tf has not come yet";
  EXPECT_EQ(found("", "", {"base_link"}), RobotNames());
}

TEST(RobotNames, thePrefixIsWithoutSlashesAroundIt) {
  EXPECT_EQ(found("/robot1", "//first/", {}).frame("base_link"), "first/base_link");
  EXPECT_EQ(renamingTo({"/robot1", "robot1"}, "/robot2", "second/").frame("robot1/odom"),
            "second/odom");
}

TEST(RobotRenaming, bringsARecordedRobotsTopicsAndFramesToAnotherRobots) {
  const RobotRenaming to = renamingTo({"/robot1", "robot1_tf"}, "/robot2", "");
  EXPECT_EQ(to.topic("/robot1/arm_controller/command"), "/robot2/arm_controller/command");
  EXPECT_EQ(to.topic("/tf"), "/tf");
  EXPECT_EQ(to.topic("/robot10/odom"), "/robot10/odom") << "another's";
  EXPECT_EQ(to.topic("/projector/green_points"), "/projector/green_points") << "nobody's";
  EXPECT_EQ(to.frame("robot1_tf/base_link"), "robot2_tf/base_link");
  EXPECT_EQ(to.frame("/robot1_tf/base_link"), "robot2_tf/base_link");
  EXPECT_EQ(to.frame("map"), "map");
  EXPECT_EQ(renamingTo({"/robot1", "robot1"}, "/robot2", "second").frame("robot1/odom"),
            "second/odom");
}

TEST(RobotRenaming, leavesNamesAloneOnTheRobotThatWasRecorded) {
  const RobotRenaming same = renamingTo({"/robot1", "robot1"}, "/robot1", "other");
  EXPECT_EQ(same.topic("/robot1/odom"), "/robot1/odom");
  EXPECT_EQ(same.frame("robot1/odom"), "robot1/odom");
  EXPECT_FALSE(same.renamesFrames());
}

TEST(RobotRenaming, bringsARobotAloneIntoANamespaceAndOutOfIt) {
  const RobotRenaming in = renamingTo({}, "/robot2", "robot2");
  EXPECT_EQ(in.topic("/odom"), "/robot2/odom");
  EXPECT_EQ(in.topic("/robot2/odom"), "/robot2/odom");
  EXPECT_EQ(in.topic("/tf"), "/tf");
  EXPECT_EQ(in.frame("base_link"), "robot2/base_link");
  EXPECT_EQ(in.frame("map"), "map");
  const RobotRenaming out = renamingTo({"/robot1", "robot1"}, "", "");
  EXPECT_EQ(out.topic("/robot1/odom"), "/odom");
  EXPECT_EQ(out.frame("robot1/odom"), "odom");
}

TEST(RobotNames, areKeptWithABehaviorAndAreUnknownOfOlderOnes) {
  Snapshot snapshot;
  Behavior behavior;
  behavior.snapshot = snapshot.toJson();
  EXPECT_FALSE(recordedRobot(behavior));
  snapshot.robot = RobotNames{"/robot1", "robot1_tf"};
  behavior.snapshot = snapshot.toJson();
  EXPECT_EQ(recordedRobot(behavior), snapshot.robot);
  snapshot.robot = RobotNames{};
  behavior.snapshot = snapshot.toJson();
  EXPECT_EQ(recordedRobot(behavior), snapshot.robot) << "alone, which is known";
  behavior.snapshot = R"({"robot": {"namespace": 3}})";
  EXPECT_EQ(recordedRobot(behavior), RobotNames()) << "somebody else's words";
  behavior.snapshot = R"({"robot": "fetch"})";
  EXPECT_FALSE(recordedRobot(behavior));
}

}  // namespace
}  // namespace afterglow::replay::robot_names_test

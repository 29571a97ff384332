// Types that Debian lacks have to be the very ones a robot speaks, or roscpp will not connect them.
// MD5s: the shared design's table, computed from the released packages.
#include <control_msgs/FollowJointTrajectoryAction.h>
#include <control_msgs/GripperCommandAction.h>
#include <control_msgs/PointHeadAction.h>
#include <controller_manager_msgs/ListControllers.h>
#include <gtest/gtest.h>
#include <jsk_recognition_msgs/PolygonArray.h>
#include <map_msgs/OccupancyGridUpdate.h>
#include <mongodb/MongoDBLoggerAction.h>
#include <sound_play/SoundRequest.h>

#include <string>

#include "replay/messages/definitions.hpp"

namespace afterglow::nodes::foreign_msgs_test {
namespace {

template <typename Message>
std::string md5() {
  return ros::message_traits::MD5Sum<Message>::value();
}

TEST(ForeignMessages, haveTheMd5OfTheRealOnes) {
  using namespace control_msgs;
  EXPECT_EQ(md5<FollowJointTrajectoryActionGoal>(), "cff5c1d533bf2f82dd0138d57f4304bb");
  EXPECT_EQ(md5<FollowJointTrajectoryActionResult>(), "c4fb3b000dc9da4fd99699380efcc5d9");
  EXPECT_EQ(md5<FollowJointTrajectoryActionFeedback>(), "d8920dc4eae9fc107e00999cce4be641");
  EXPECT_EQ(md5<GripperCommandActionGoal>(), "aa581f648a35ed681db2ec0bf7a82bea");
  EXPECT_EQ(md5<GripperCommandActionResult>(), "143702cb2df0f163c5283cedc5efc6b6");
  EXPECT_EQ(md5<GripperCommandActionFeedback>(), "653dff30c045f5e6ff3feb3409f4558d");
  EXPECT_EQ(md5<PointHeadActionGoal>(), "b53a8323d0ba7b310ba17a2d3a82a6b8");
  EXPECT_EQ(md5<PointHeadActionResult>(), "1eb06eeff08fa7ea874431638cb52332");
  EXPECT_EQ(md5<PointHeadActionFeedback>(), "33c9244957176bbba97dd641119e8460");
  EXPECT_EQ(md5<map_msgs::OccupancyGridUpdate>(), "b295be292b335c34718bd939deebe1c9");
  EXPECT_EQ(md5<jsk_recognition_msgs::PolygonArray>(), "709b37d39871cfdbbfbd5c41cf9bc2be");
  EXPECT_EQ(md5<sound_play::SoundRequest>(), "d098ce4a040686259137ece23a625167");
  EXPECT_STREQ(ros::service_traits::md5sum<controller_manager_msgs::ListControllers>(),
               "1341feb2e63fa791f855565d0da950d8");
  EXPECT_EQ(md5<mongodb::MongoDBLoggerActionGoal>(), "c31dbdc237497789e7dd0b0bd9516b3a");
  EXPECT_EQ(md5<mongodb::MongoDBLoggerActionResult>(), "9ad6eba1b50ad0a0157d220a9c118734");
  EXPECT_EQ(md5<mongodb::MongoDBLoggerActionFeedback>(), "6f64bc7d0be7dd3495c478b83475d9ac");
}

TEST(ForeignMessages, haveTheFullNamesOfTheRealOnes) {
  using ros::message_traits::DataType;
  EXPECT_STREQ(DataType<control_msgs::FollowJointTrajectoryActionGoal>::value(),
               "control_msgs/FollowJointTrajectoryActionGoal");
  EXPECT_STREQ(DataType<mongodb::MongoDBLoggerActionGoal>::value(),
               "mongodb/MongoDBLoggerActionGoal");
  EXPECT_STREQ(DataType<sound_play::SoundRequest>::value(), "sound_play/SoundRequest");
}

TEST(ForeignMessages, areAmongTheDefinitionsOfThisMachine) {
  const auto installed = afterglow::replay::installedDefinitions();
  EXPECT_EQ(installed.find("control_msgs/PointHeadActionGoal").value().md5,
            md5<control_msgs::PointHeadActionGoal>());
  EXPECT_EQ(installed.find("control_msgs/FollowJointTrajectoryActionGoal").value().md5,
            md5<control_msgs::FollowJointTrajectoryActionGoal>());
  EXPECT_EQ(installed.find("sound_play/SoundRequest").value().md5,
            md5<sound_play::SoundRequest>());
}

}  // namespace
}  // namespace afterglow::nodes::foreign_msgs_test

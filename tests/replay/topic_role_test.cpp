#include "replay/play/topic_role.hpp"

#include <gtest/gtest.h>

namespace afterglow::replay::topic_role_test {
namespace {

TEST(TopicRole, bodyIsWhatMovesARobot) {
  const auto expectBody = [](const char* topic, const char* type) {
    EXPECT_EQ(modalityOf(topic, type), Modality::Body) << topic << " " << type;
    EXPECT_TRUE(isReplayable(topic, type)) << topic << " " << type;
  };
  expectBody("/cmd_vel", "geometry_msgs/Twist");
  expectBody("/base/mux/input", "geometry_msgs/TwistStamped");
  expectBody("/arm_with_torso_controller/follow_joint_trajectory/goal",
             "control_msgs/FollowJointTrajectoryActionGoal");
  expectBody("/arm_with_torso_controller/follow_joint_trajectory/cancel", "actionlib_msgs/GoalID");
  expectBody("/gripper_controller/gripper_action/goal", "control_msgs/GripperCommandActionGoal");
  expectBody("/arm_controller/command", "trajectory_msgs/JointTrajectory");
  expectBody("/head_pan_controller/command", "std_msgs/Float64");
  expectBody("/move_base_simple/goal", "geometry_msgs/PoseStamped");
}

TEST(TopicRole, speechIsSoundPlay) {
  EXPECT_EQ(modalityOf("/robotsound", "sound_play/SoundRequest"), Modality::Speech);
  EXPECT_EQ(modalityOf("/sound_play/goal", "sound_play/SoundRequestActionGoal"), Modality::Speech);
  EXPECT_EQ(modalityOf("/sound_play/cancel", "actionlib_msgs/GoalID"), Modality::Speech);
}

TEST(TopicRole, arIsTheRest) {
  for (const char* type :
       {"sensor_msgs/PointCloud2", "visualization_msgs/Marker", "visualization_msgs/MarkerArray",
        "nav_msgs/Path", "sensor_msgs/LaserScan", "std_msgs/String"}) {
    EXPECT_EQ(modalityOf("/projector/x", type), Modality::Ar) << type;
    EXPECT_TRUE(isReplayable("/projector/x", type)) << type;
  }
}

TEST(TopicRole, isNamed) {
  EXPECT_EQ(name(Modality::Body), "body");
  EXPECT_EQ(name(Modality::Ar), "ar");
  EXPECT_EQ(name(Modality::Speech), "speech");
}

TEST(TopicRole, answersAndContextAreNeverReplayed) {
  const auto expectKept = [](const char* topic, const char* type) {
    EXPECT_FALSE(isReplayable(topic, type)) << topic << " " << type;
  };
  expectKept("/tf", "tf2_msgs/TFMessage");
  expectKept("/tf_static", "tf2_msgs/TFMessage");
  expectKept("/robot1/tf", "tf/tfMessage");
  expectKept("/clock", "rosgraph_msgs/Clock");
  expectKept("/rosout", "rosgraph_msgs/Log");
  expectKept("/rosout_agg", "rosgraph_msgs/Log");
  expectKept("/diagnostics", "diagnostic_msgs/DiagnosticArray");
  expectKept("/a/result", "control_msgs/FollowJointTrajectoryActionResult");
  expectKept("/a/feedback", "control_msgs/FollowJointTrajectoryActionFeedback");
  expectKept("/a/status", "actionlib_msgs/GoalStatusArray");
  expectKept("/joint_states", "sensor_msgs/JointState");
  expectKept("/odom", "nav_msgs/Odometry");
  EXPECT_EQ(whyNeverReplayed("/a/result", "control_msgs/PointHeadActionResult"),
            "an answer of the robot; it gives a new one");
}

TEST(TopicRole, takesWholeNamesOnly) {
  EXPECT_TRUE(isReplayable("/my_tf_markers", "visualization_msgs/Marker"));
  EXPECT_TRUE(isReplayable("/results", "visualization_msgs/Marker"));
  EXPECT_EQ(modalityOf("/goals", "visualization_msgs/Marker"), Modality::Ar);
}

}  // namespace
}  // namespace afterglow::replay::topic_role_test

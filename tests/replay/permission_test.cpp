#include "replay/plan/permission.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/recorded_robot.hpp"

namespace afterglow::replay::permission_test {
namespace {

using Robot = test::RecordedRobot;
using Texts = std::vector<std::string>;

const std::string kTwist = "geometry_msgs/Twist";

constexpr TopicKind kKinds[] = {TopicKind::Body,    TopicKind::NamedMotion, TopicKind::Shown,
                                TopicKind::Other,   TopicKind::Control,     TopicKind::Endless,
                                TopicKind::Forbidden};
constexpr NamedBy kNamers[] = {NamedBy::Nobody, NamedBy::Recording, NamedBy::Owner,
                               NamedBy::Replayer};

bool isPublished(Verdict verdict) { return verdict == Verdict::Publish || verdict == Verdict::Warn; }

std::string classOf(const PlayPlan& plan, const std::string& topic) {
  for (const PlannedTopic& one : plan.topics) {
    if (one.channel.topic == topic) return std::string(name(one.topic_class));
  }
  return "not planned";
}

TEST(Permission, ofNobodyIsLightAndSpeechAloneBesideARobot) {
  for (const TopicKind kind : kKinds) {
    for (const NamedBy named_by : kNamers) {
      const bool is_light = kind == TopicKind::Shown && named_by != NamedBy::Nobody;
      EXPECT_EQ(isPublished(verdictOf({kind, named_by, false, ReplayPlace::Robot})), is_light)
          << static_cast<int>(kind) << " " << static_cast<int>(named_by);
    }
  }
}

TEST(Permission, ofTheOwnerDoesNotPublishWhatNothingStopsOrNobodyNamed) {
  for (const NamedBy named_by : kNamers) {
    for (const ReplayPlace place : {ReplayPlace::Robot, ReplayPlace::Elsewhere}) {
      EXPECT_FALSE(isPublished(verdictOf({TopicKind::Endless, named_by, true, place})));
      EXPECT_FALSE(isPublished(verdictOf({TopicKind::Forbidden, named_by, true, place})));
      const Verdict control = verdictOf({TopicKind::Control, named_by, true, place});
      EXPECT_EQ(control, named_by >= NamedBy::Owner ? Verdict::Warn : Verdict::LeaveOut);
    }
  }
  EXPECT_EQ(verdictOf({TopicKind::Other, NamedBy::Nobody, true, ReplayPlace::Robot}),
            Verdict::LeaveOut);
  EXPECT_EQ(verdictOf({TopicKind::Body, NamedBy::Nobody, true, ReplayPlace::Robot}),
            Verdict::Publish);
}

TEST(Permission, isWhatTheReadmeSays) {
  std::ifstream file("replay/README.md");
  const std::string readme((std::istreambuf_iterator<char>(file)),
                           std::istreambuf_iterator<char>());
  EXPECT_NE(readme.find(permissionTable()), std::string::npos) << permissionTable();
}

// ------------------------------------------------------------------------------------- in a plan

TEST(Permission, isAskedForControlInputsAndForWhatNobodyKnows) {
  Robot robot;
  robot.add("/joy", "sensor_msgs/Joy");
  robot.add("/thing", "my_msgs/Thing");
  robot.add("/initialpose", "geometry_msgs/PoseWithCovarianceStamped");
  robot.add("/path", "nav_msgs/Path");
  PlanOptions options;
  options.also = {"/joy", "/thing", "/initialpose", "/path"};
  EXPECT_EQ(robot.plan(options).refusal(),
            "motion is not allowed here (~allow_motion, --allow-motion), and light and speech "
            "alone are played without it, not /initialpose (control input: it moves the robot's "
            "estimate of where it stands), /joy (control input: a joystick: base and arm are driven "
            "by it), /thing (other: what acts on it is not known)");
  options.also = {"/path"};
  EXPECT_EQ(robot.plan(options).refusal(), "");
  EXPECT_EQ(robot.plan(options).playedTopics(), Texts{"/path"});
  options.also.clear();
  options.settled = {"/joy", "/thing"};
  EXPECT_EQ(robot.plan(options).playedTopics(), Texts()) << "an owner's setting is no permission";
  options.is_motion_allowed = true;
  EXPECT_EQ(robot.plan(options).playedTopics(), (Texts{"/joy", "/thing"}));
  EXPECT_EQ(robot.plan(options).warnings().size(), 1u);
}

TEST(Permission, ofWhatMayMoveByItsNameOrTypeNeedsARule) {
  for (const auto& [topic, type] : std::vector<std::pair<std::string, std::string>>{
           {"/my_arm/joint_speeds", "my_msgs/JointSpeeds"},
           {"/my_arm/joint_speeds", "my_msgs/Numbers"},
           {"/my_arm/joint_speeds", "std_msgs/Float64MultiArray"},
           {"/drive", "my_msgs/Thing"},
           {"/wheels", "my_msgs/WheelCommand"},
           {"/out", "my_msgs/MotorSetpoint"}}) {
    Robot robot;
    robot.add(topic, type);
    PlanOptions options;
    options.also = {topic};
    for (const bool is_allowed : {false, true}) {
      options.is_motion_allowed = is_allowed;
      EXPECT_EQ(robot.plan(options).playedTopics(), Texts()) << topic << " " << type;
      EXPECT_NE(robot.plan(options).refusal().find("or say in --rules what stops it"),
                std::string::npos)
          << topic << " " << type;
    }
    options.rewriting.stops[topic] = {StopKind::Cancel, "/no_more", {}, "rules.yaml:3"};
    EXPECT_EQ(classOf(robot.plan(options), topic), "body") << topic << " " << type;
  }
}

TEST(Permission, isNeverGivenToWhatTheReplayObeys) {
  Robot robot;
  robot.add("/joy", "sensor_msgs/Joy");
  robot.add("/robot/halted", "std_msgs/Bool");
  robot.add("/said", "std_msgs/String");
  PlanOptions options = Robot::allowed();
  options.obeyed = {{"/joy", "the button to be held"}, {"/robot/halted", "the emergency stop"}};
  options.also = {"/joy"};
  EXPECT_EQ(robot.plan(options).refusal(),
            "/joy (sensor_msgs/Joy) is not played: it is the button to be held that this replay "
            "obeys; --exclude it to play the rest");
  options.also = {"/said"};
  options.remap = {{"/said", "/robot/halted"}};
  EXPECT_NE(robot.plan(options).refusal(), "");
  options.remap.clear();
  options.resolve = [](const TopicName& name) {
    return name == "/said" ? TopicName("/joy") : name;  // as by /said:=/joy on a command line
  };
  EXPECT_NE(robot.plan(options).refusal(), "");
  EXPECT_EQ(robot.plan(options).topics.back().output.topic, "/joy");
}

TEST(Permission, isOfTheCleanNameOfWhatWasRecorded) {
  Robot robot;
  robot.add("/base_controller//command", kTwist);
  const PlayPlan plan = robot.plan();
  EXPECT_EQ(classOf(plan, "/base_controller//command"), "other");
  EXPECT_EQ(plan.playedTopics(), Texts());
  EXPECT_EQ(plan.topics[0].why_class, "the base behind its multiplexer: nobody could override it");
  PlanOptions options = Robot::allowed();
  options.also = {"/base_controller/command"};
  ASSERT_EQ(robot.plan(options).playedTopics(), Texts{"/base_controller//command"});
  EXPECT_EQ(robot.plan(options).topics[0].output.topic, "/base_controller/command");
}

TEST(Permission, isNotGivenToNamesThatRosHasNot) {
  Robot robot;
  robot.add("/caf\xc3\xa9", "visualization_msgs/Marker");
  robot.add("relative", kTwist);
  robot.snapshot.requested = {"/caf\xc3\xa9", "relative"};
  PlanOptions options = Robot::allowed();
  options.regex = ".*";
  const PlayPlan plan = robot.plan(options);
  EXPECT_EQ(plan.playedTopics(), Texts());
  EXPECT_EQ(test::whyNot(plan, "relative"), "ROS has no topic of that name");
  EXPECT_EQ(plan.refusal(), "") << "the rest is played";
}

TEST(Permission, ofAPrefixHoldsUnderItAlone) {
  Robot robot;
  robot.add("/odom", "nav_msgs/Odometry");
  robot.add("/map", "nav_msgs/OccupancyGrid");
  PlanOptions options;
  options.place = ReplayPlace::Elsewhere;
  options.prefix = "/then";
  EXPECT_EQ(robot.plan(options).playedTopics(), (Texts{"/map", "/odom"}));
  options.remap = {{"/odom", "/odom"}};
  EXPECT_EQ(robot.plan(options).playedTopics(), Texts{"/map"});
  options.remap.clear();
  options.resolve = [](const TopicName& name) {
    return name == "/then/odom" ? TopicName("/odom") : name;
  };
  EXPECT_EQ(robot.plan(options).playedTopics(), Texts{"/map"});
  options.prefix = "/";
  EXPECT_EQ(robot.plan(options).playedTopics(), Texts()) << "it changes no name";
}

// ------------------------------------------------------------------- the base behind its multiplexer

TEST(Permission, ofTheBaseItselfIsThatOfTheBodyWhereItIsNamed) {
  const std::string base = "/mobile_base_controller/cmd_vel";
  Robot robot;
  robot.add(base, kTwist);
  EXPECT_EQ(classOf(robot.plan(), base), "other");
  PlanOptions options;
  options.also = {base};
  EXPECT_EQ(robot.plan(options).refusal(),
            "motion is not allowed here (~allow_motion, --allow-motion), and this behavior moves "
            "the robot by /mobile_base_controller/cmd_vel");
  options.is_motion_allowed = true;
  EXPECT_EQ(classOf(robot.plan(options), base), "body");
  EXPECT_EQ(robot.plan(options).motionTopics(), Texts{base});
  robot.note(base, kTwist, {{"/twist_mux"}, {"/controllers"}});
  EXPECT_EQ(classOf(robot.plan(options), base), "body") << "it is named";
}

TEST(Permission, ofABaseWithoutAMultiplexerIsThatOfTheBodyWhereItIsRequested) {
  const std::string base = "/mobile_base_controller/cmd_vel";
  Robot robot;
  robot.add(base, kTwist, {{"/move_base"}, {"/controllers"}});
  EXPECT_EQ(classOf(robot.plan(), base), "other") << "recorded by a pattern";
  robot.snapshot.requested = {base};
  EXPECT_EQ(classOf(robot.plan(), base), "body");
  EXPECT_EQ(robot.plan().playedTopics(), Texts{base});
  robot.note(base, kTwist, {{"/twist_mux"}, {"/controllers"}});
  EXPECT_EQ(classOf(robot.plan(), base), "other") << "a multiplexer sent it";
}

TEST(Permission, ofTheBaseThatAProfileNamesIsThatOfTheBodyWhereItIsRequestedToo) {
  Robot robot;
  robot.add("/drive", kTwist, {{"/move_base"}, {"/controllers"}});
  robot.snapshot.requested = {"/drive"};
  PlanOptions options = Robot::allowed();
  options.robot.base.output_topic = "/drive";
  options.robot.base.velocity_topic = "/cmd_vel";
  EXPECT_EQ(classOf(robot.plan(options), "/drive"), "body") << "no multiplexer stood before it";
  robot.snapshot.requested.clear();
  EXPECT_EQ(classOf(robot.plan(options), "/drive"), "other");
}

TEST(Permission, thatIsMissingIsSaidWithWhatIsShownWithoutIt) {
  Robot robot;
  robot.add("/cmd_vel", kTwist);
  robot.add("/projection/markers", "visualization_msgs/MarkerArray");
  robot.snapshot.requested = {"/cmd_vel", "/projection/markers"};
  EXPECT_EQ(robot.plan({}).refusal(),
            "motion is not allowed here (~allow_motion, --allow-motion), and this behavior moves "
            "the robot by /cmd_vel; --only ar,speech shows /projection/markers");
}

// ---------------------------------------------------------------------- rules, and names that tell

TEST(Permission, ofWhatNobodyKnowsIsThatOfTheBodyWithARuleThatStopsIt) {
  const std::string unknown = "/lamp/setting", base = "/mobile_base_controller/cmd_vel";
  Robot robot;
  robot.add(unknown, "my_msgs/Setting");
  robot.add(base, kTwist);
  PlanOptions options = Robot::allowed();
  MotionStop stop;
  stop.kind = StopKind::Cancel;
  stop.cancel_topic = "/halt";
  EXPECT_EQ(classOf(robot.plan(options), unknown), "other");
  options.rewriting.stops = {{unknown, stop}, {base, stop}};
  const PlayPlan plan = robot.plan(options);
  EXPECT_EQ(classOf(plan, unknown), "body");
  EXPECT_EQ(classOf(plan, base), "other")
      << "its stop was known: it is left out for another reason";
}

TEST(Cancel, isOfATypeAndAName) {
  EXPECT_TRUE(isCancel({"/arm/cancel", kGoalIdType, "", "", false, ""}));
  EXPECT_FALSE(isCancel({"/arm/last_goal", kGoalIdType, "", "", false, ""}));
  EXPECT_FALSE(isCancel({"/order/cancel", "std_msgs/Empty", "", "", false, ""}));
}

TEST(Permission, ofAControllerOfVelocitiesStaysThatOfTheBodyUnderAnyName) {
  const std::string recorded = "/wheel_velocity_controller/command";
  Robot robot;
  robot.add(recorded, "std_msgs/Float64");
  PlanOptions options = Robot::allowed();
  EXPECT_EQ(classOf(robot.plan(options), recorded), "body");
  options.remap = {{recorded, "/elsewhere"}};
  EXPECT_EQ(classOf(robot.plan(options), recorded), "body");
  options.remap = {{recorded, "/robot/motors_halted"}};
  EXPECT_EQ(classOf(robot.plan(options), recorded), "control input");
}

}  // namespace
}  // namespace afterglow::replay::permission_test

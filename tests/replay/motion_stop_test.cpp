// What stops each kind of motion, when it is in motion, how fast it may be, and that no number of
// it is NaN.
#include "replay/plan/motion_stop.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <tuple>
#include <vector>

#include "replay/motion/motion_limits.hpp"
#include "replay/motion/motion_rate.hpp"
#include "replay/motion/stops/motion_monitor.hpp"
#include "replay/motion/stops/stop_maker.hpp"
#include "tests/support/player_world.hpp"

namespace afterglow::replay::motion_stop_test {
namespace {

using namespace test;

constexpr double kFast = 0.5;  // beyond the limits of these tests

const std::string kAckermann =
    "float32 steering_angle\nfloat32 steering_angle_velocity\nfloat32 speed\n"
    "float32 acceleration\nfloat32 jerk\n";
const std::string kVectors = "Vector3 linear\nVector3 angular\n";
const std::string kGripperCommand = "float64 position\nfloat64 max_effort\n";
const std::string kMultiArray =
    withTypes("MultiArrayLayout layout\nfloat64[] data\n", "std_msgs/MultiArrayLayout",
              "MultiArrayDimension[] dim\nuint32 data_offset\n", "std_msgs/MultiArrayDimension",
              "string label\nuint32 size\nuint32 stride\n");
const std::string kPoseStamped =
    withTypes("Header header\nPose pose\n", "std_msgs/Header", kHeader, "geometry_msgs/Pose",
              "Point position\nQuaternion orientation\n", "geometry_msgs/Point", kPoint,
              "geometry_msgs/Quaternion", kPoint + "float64 w\n");

/// Of an action "package/Name" whose goal has these fields.
template <typename... Rest>
Channel goalChannel(const std::string& topic, const std::string& package, const std::string& name,
                    const std::string& goal, const Rest&... rest) {
  return channelOf(
      topic, package + "/" + name + "ActionGoal",
      withTypes("Header header\nactionlib_msgs/GoalID goal_id\n" + name + "Goal goal\n",
                "std_msgs/Header", kHeader, "actionlib_msgs/GoalID", kGoalId,
                package + "/" + name + "Goal", goal, rest...));
}

Bytes with(const Channel& channel, const std::string& path, Value value) {
  Value message = blank(channel);
  test::at(message, path) = std::move(value);
  return encode(schemaOf(channel), message);
}

Bytes group(const std::vector<double>& numbers) {
  return with(channelOf("/any", "std_msgs/Float64MultiArray", kMultiArray), "data",
              numberArray(numbers));
}

Bytes drive(float steering, float speed, float acceleration = 0) {
  const Channel channel = channelOf("/any", "ackermann_msgs/AckermannDrive", kAckermann);
  Value message = blank(channel);
  test::at(message, "steering_angle") = steering;
  test::at(message, "speed") = speed;
  test::at(message, "acceleration") = acceleration;
  return encode(schemaOf(channel), message);
}

/// One point with one velocity; `at` is where the trajectory lies: "" or "goal.trajectory.".
Bytes trajectory(const Channel& channel, const std::string& at, double velocity) {
  const Schema schema = schemaOf(channel);
  Value message = blank(channel);
  Value point = blank(schema, "trajectory_msgs/JointTrajectoryPoint");
  test::at(point, "positions") = numberArray({0.1});
  test::at(point, "velocities") = numberArray({velocity});
  test::at(message, at + "joint_names") = Array{std::string("elbow")};
  test::at(message, at + "points") = Array{point};
  return encode(schema, message);
}

const Channel kDrone = channelOf(
    "/drone/command/trajectory", "trajectory_msgs/MultiDOFJointTrajectory",
    withTypes("Header header\nstring[] joint_names\nMultiDOFJointTrajectoryPoint[] points\n",
              "std_msgs/Header", kHeader, "trajectory_msgs/MultiDOFJointTrajectoryPoint",
              "geometry_msgs/Transform[] transforms\ngeometry_msgs/Twist[] velocities\n"
              "geometry_msgs/Twist[] accelerations\nduration time_from_start\n",
              "geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n",
              "geometry_msgs/Vector3", kPoint, "geometry_msgs/Quaternion", kPoint + "float64 w\n",
              "geometry_msgs/Twist", kVectors));

/// Of one body, which is at these places, m on a way aslant, two seconds apart; with velocities of
/// m/s and rad/s.
Bytes flight(const std::vector<double>& places, double speed, double turn) {
  const Schema schema = schemaOf(kDrone);
  Value transform = blank(schema, "geometry_msgs/Transform");
  Value velocity = blank(schema, "geometry_msgs/Twist");
  for (const char* axis : {".x", ".y", ".z"}) {
    for (const char* part : {"translation", "rotation"}) {
      test::at(transform, std::string(part) + axis) = 0.0;
    }
    for (const char* part : {"linear", "angular"})
      test::at(velocity, std::string(part) + axis) = 0.0;
  }
  test::at(transform, "rotation.w") = 1.0;
  test::at(velocity, "linear.z") = speed;
  test::at(velocity, "angular.x") = turn;
  Array points;
  for (std::size_t i = 0; i < places.size(); ++i) {
    Value point = blank(schema, "trajectory_msgs/MultiDOFJointTrajectoryPoint");
    test::at(transform, "translation.x") = places[i] / 3 + 5;
    test::at(transform, "translation.y") = -places[i] * 2 / 3 + 5;
    test::at(transform, "translation.z") = places[i] * 2 / 3 + 5;
    test::at(point, "transforms") = Array{transform};
    test::at(point, "velocities") = Array{velocity};
    test::at(point, "accelerations") = Array{};
    test::at(point, "time_from_start") = RosDuration{static_cast<std::int32_t>(2 * i), 0};
    points.push_back(point);
  }
  Value message = blank(kDrone);
  test::at(message, "joint_names") = Array{std::string("drone")};
  test::at(message, "points") = points;
  return encode(schema, message);
}

// -------------------------------------------------------------------------------- one of each kind

/// A kind of motion: its channel, and a message of it in which a velocity, or where it has none a
/// position, is this number.
struct Kind {
  Channel channel;
  std::function<Bytes(double)> moving;
  bool has_velocity = true;
};

Kind numberKind(const Channel& channel, const std::string& path, bool has_velocity = true) {
  return {channel, [=](double number) { return with(channel, path, number); }, has_velocity};
}

Kind trajectoryKind(const Channel& channel, const std::string& at) {
  return {channel, [=](double velocity) { return trajectory(channel, at, velocity); }};
}

/// By the patterns of the table.
std::map<std::string, Kind> kinds() {
  const Channel stamped_twist = channelOf(
      "/base/cmd_vel", "geometry_msgs/TwistStamped",
      withTypes("Header header\nTwist twist\n", "std_msgs/Header", kHeader, "geometry_msgs/Twist",
                kVectors, "geometry_msgs/Vector3", kPoint));
  const Channel ackermann =
      channelOf("/ackermann_cmd", "ackermann_msgs/AckermannDrive", kAckermann);
  const Channel stamped_ackermann = channelOf(
      "/ackermann_cmd", "ackermann_msgs/AckermannDriveStamped",
      withTypes("Header header\nAckermannDrive drive\n", "std_msgs/Header", kHeader,
                "ackermann_msgs/AckermannDrive", kAckermann));
  const Channel joint_trajectory =
      goalChannel("/r_arm_controller/joint_trajectory_action/goal", "pr2_controllers_msgs",
                  "JointTrajectory", "trajectory_msgs/JointTrajectory trajectory\n",
                  "trajectory_msgs/JointTrajectory", kJointTrajectory,
                  "trajectory_msgs/JointTrajectoryPoint", kJointTrajectoryPoint);
  const auto drives = [](const Channel& channel, const char* path) {
    return Kind{channel, [=](double speed) {
                  return with(channel, path, static_cast<float>(speed));
                }};
  };
  return {
      {"geometry_msgs/Twist", numberKind(kCmdVel, "linear.x")},
      {"geometry_msgs/TwistStamped", numberKind(stamped_twist, "twist.linear.x")},
      {"ackermann_msgs/AckermannDrive", drives(ackermann, "speed")},
      {"ackermann_msgs/AckermannDriveStamped", drives(stamped_ackermann, "drive.speed")},
      {"trajectory_msgs/JointTrajectory",
       trajectoryKind(channelOf("/arm_controller/command", "trajectory_msgs/JointTrajectory",
                                kBareTrajectory),
                      "")},
      {"control_msgs/FollowJointTrajectoryActionGoal", trajectoryKind(kArm, "goal.trajectory.")},
      {"*/JointTrajectoryActionGoal", trajectoryKind(joint_trajectory, "goal.trajectory.")},
      {"*/PointHeadActionGoal",
       numberKind(channelOf("/head_controller/point_head/goal", "control_msgs/PointHeadActionGoal",
                            kPointHeadActionGoal),
                  "goal.max_velocity")},
      {"*/SingleJointPositionActionGoal",
       numberKind(goalChannel("/torso_controller/position_joint_action/goal",
                              "pr2_controllers_msgs", "SingleJointPosition",
                              "float64 position\nduration min_duration\nfloat64 max_velocity\n"),
                  "goal.max_velocity")},
      {"control_msgs/GripperCommandActionGoal",
       numberKind(goalChannel("/gripper_controller/gripper_action/goal", "control_msgs",
                              "GripperCommand", "GripperCommand command\n",
                              "control_msgs/GripperCommand", kGripperCommand),
                  "goal.command.position", false)},
      {"pr2_controllers_msgs/Pr2GripperCommand*",
       numberKind(goalChannel("/r_gripper_controller/gripper_action/goal", "pr2_controllers_msgs",
                              "Pr2GripperCommand", "Pr2GripperCommand command\n",
                              "pr2_controllers_msgs/Pr2GripperCommand", kGripperCommand),
                  "goal.command.position", false)},
      {"std_msgs/Float64", numberKind(channelOf("/wheel_velocity_controller/command",
                                                "std_msgs/Float64", "float64 data\n"),
                                      "data")},
      {"std_msgs/Float64MultiArray",
       {channelOf("/joint_group_vel_controller/command", "std_msgs/Float64MultiArray",
                  kMultiArray),
        [](double velocity) { return group({0, velocity}); }}}};
}

PlannedTopic plannedTopic(const Channel& channel) {
  PlannedTopic topic;
  topic.channel = topic.output = channel;
  topic.modality = Modality::Body;
  topic.topic_class = TopicClass::Body;
  return topic;
}

/// A behavior of one message.
struct OneMessage {
  OneMessage(const Channel& channel, const Bytes& bytes) {
    Message message;
    const std::int64_t recording = store->addRecording({0, "", "test", ""});
    message.channel = store->addChannel(recording, channel);
    message.received = {kBegin + 700 * kMs};
    message.bytes = bytes;
    store->append({message});
    plan.behavior.recording = recording;
    plan.behavior.name = "one";
    plan.behavior.begin = plan.begin = {kBegin};
    plan.behavior.end = plan.end = {kBegin + 1000 * kMs};
    plan.behavior.topics = {channel.topic};
    plan.behavior.id = store->addBehavior(plan.behavior);
    plan.topics = {plannedTopic(channel)};
  }
  std::unique_ptr<FaultyStore> store = std::make_unique<FaultyStore>();
  PlayPlan plan;
};

/// Of all that moves the body, as patterns.
std::vector<std::string> bodyTypes() {
  std::vector<std::string> types;
  for (const TopicRow& row : TopicTable::ofAllRobots().rows) {
    const bool moves = row.is_motion && row.role.topic_class == TopicClass::Body &&
                       row.role.stop != StopKind::IsStop;
    if (moves) types.insert(types.end(), row.types.begin(), row.types.end());
  }
  return types;
}

TEST(KindsOfMotion, areAllStoppedLimitedAndCheckedForNumbers) {
  const std::map<std::string, Kind> known = kinds();
  for (const std::string& pattern : bodyTypes()) {
    const bool is_known = known.count(std::string(pattern)) > 0;
    EXPECT_TRUE(is_known) << pattern << " is the body's: how is it stopped, limited, checked?";
  }
  EXPECT_EQ(known.size(), bodyTypes().size());
}

TEST(KindsOfMotion, areInMotionUntilTheirStopIsSent) {
  for (const auto& [pattern, kind] : kinds()) {
    SCOPED_TRACE(pattern);
    PlayPlan plan;
    plan.topics = {plannedTopic(kind.channel)};
    MotionMonitor watch(plan);
    EXPECT_TRUE(watch.sending(kind.channel, kind.moving(kFast)).is_motion);
    if (stopOf(plan.topics[0]).kind == StopKind::EndsItself) {
      EXPECT_EQ(pattern, "pr2_controllers_msgs/Pr2GripperCommand*") << "a cancel lets go";
      EXPECT_TRUE(watch.outputs().empty());
      continue;
    }
    EXPECT_FALSE(watch.moving().empty());
    const Outputs moving = watch.moving();
    for (const std::uint32_t output : moving) {
      const MotionMonitor::Output stop = watch.outputs().at(output);
      EXPECT_FALSE(watch.sending(stop.channel, stop.stop).is_motion);
    }
    EXPECT_TRUE(watch.moving().empty());
  }
}

TEST(KindsOfMotion, areHeldToTheLimits) {
  MotionLimits limits;
  limits.linear = limits.other_joints.velocity = 0.1;
  for (const auto& [pattern, kind] : kinds()) {
    const OneMessage fast(kind.channel, kind.moving(kFast)), slow(kind.channel, kind.moving(0.05));
    const std::string why = whyTooFast(motionPeaks(*fast.store, fast.plan, limits), 1);
    EXPECT_EQ(why.find("above the limit of 0.1") != std::string::npos, kind.has_velocity)
        << pattern << ": " << why;
    EXPECT_EQ(whyTooFast(motionPeaks(*slow.store, slow.plan, limits), 1), "") << pattern;
  }
}

/// Drones and boats, of which a rule says what stops them.
TEST(KindsOfMotion, areHeldToTheLimitsWhereTheyFly) {
  MotionLimits limits;
  limits.linear = 0.1;
  limits.angular = 0.2;
  const auto why = [&](const std::vector<double>& places, double speed, double turn) {
    const OneMessage one(kDrone, flight(places, speed, turn));
    return whyTooFast(motionPeaks(*one.store, one.plan, limits), 1);
  };
  EXPECT_EQ(why({0, 0.15, 0}, 0.05, 0.15), "");
  EXPECT_EQ(why({0}, 0.5, 0),
            "/drone/command/trajectory: linear velocity of 0.5 m/s at rate 1, 0.7 s into the "
            "behavior, is above the limit of 0.1");
  EXPECT_EQ(why({0}, 0, -0.5),
            "/drone/command/trajectory: angular velocity of 0.5 rad/s at rate 1, 0.7 s into the "
            "behavior, is above the limit of 0.2");
  EXPECT_EQ(why({0, 0.1, -0.5}, 0, 0),
            "/drone/command/trajectory: linear velocity of 0.3 m/s at rate 1, 4.7 s into the "
            "behavior, is above the limit of 0.1")
      << "by its places, though it claims to stand";
  EXPECT_THROW(why({0, std::nan("")}, 0, 0), std::runtime_error);
}

TEST(KindsOfMotion, areHeldInHowFastTheySteer) {
  MotionLimits limits;
  limits.other_joints.velocity = 0.5;
  const Channel channel = channelOf("/ackermann_cmd", "ackermann_msgs/AckermannDrive", kAckermann);
  const auto why = [&](float steering) {
    const OneMessage one(channel, with(channel, "steering_angle_velocity", steering));
    return whyTooFast(motionPeaks(*one.store, one.plan, limits), 1);
  };
  EXPECT_EQ(why(0.4F), "");
  EXPECT_NE(why(-0.75F).find("velocity of the steering of 0.75 rad/s"), std::string::npos);
}

TEST(KindsOfMotion, areRefusedWithNumbersThatAreNone) {
  for (const auto& [pattern, kind] : kinds()) {
    for (const double odd : {std::nan(""), std::numeric_limits<double>::infinity()}) {
      const OneMessage one(kind.channel, kind.moving(odd));
      try {
        motionPeaks(*one.store, one.plan, MotionLimits());
        ADD_FAILURE() << pattern;
      } catch (const std::runtime_error& error) {
        const std::string text = error.what();
        EXPECT_EQ(text.find(kind.channel.topic + ": "), 0u) << text;
        EXPECT_NE(text.find(std::isnan(odd) ? " is nan, 0.7 s" : " is inf, 0.7 s"),
                  std::string::npos)
            << text;
      }
    }
  }
}

TEST(KindsOfMotion, areSlowedDownByTheirRateOrPlayedAsRecordedOnly) {
  for (const auto& [pattern, kind] : kinds()) {
    PlannedTopic topic = plannedTopic(kind.channel);
    const MotionRate scaling(schemaOf(kind.channel), hasJointVelocities(topic));
    Bytes bytes = kind.moving(kFast);
    scaling.apply(bytes, 0.5);
    EXPECT_EQ(bytes == kind.moving(kFast / 2), kind.has_velocity) << pattern;
    PlayPlan plan;
    plan.topics = {topic};
    EXPECT_EQ(whyOnlyAsRecorded(plan), "") << pattern;
  }
}

/// goal.max_velocity of a head goal that asked for `velocity`, at a rate.
double headVelocityAt(double rate, double velocity) {
  const Kind head = kinds().at("*/PointHeadActionGoal");
  const Schema schema = schemaOf(head.channel);
  Bytes bytes = head.moving(velocity);
  MotionRate(schema).apply(bytes, rate);
  Value goal = decode(schema, bytes);
  return std::get<double>(test::at(goal, "goal.max_velocity"));
}

TEST(MotionRate, slowsTheHeadThatAsksForNoVelocity) {
  const double half = headVelocityAt(0.5, 0);
  EXPECT_GT(half, 0);
  EXPECT_DOUBLE_EQ(headVelocityAt(0.25, 0), half / 2);
  EXPECT_EQ(headVelocityAt(1, 0), 0);
  EXPECT_EQ(headVelocityAt(2, 0), 0);
  EXPECT_EQ(headVelocityAt(0.5, 0.3), 0.15);
}

TEST(MotionRate, refusesDurationsThatFitNoMessage) {
  Bytes goal = goalMessage("a", {1, 4});
  const MotionRate slow(schemaOf(kArm));
  try {
    slow.apply(goal, 1e-9);
    FAIL() << "4000 million seconds";
  } catch (const MessageError& error) {
    EXPECT_STREQ(error.what(), "a duration of 4000000000.000000 s fits no message");
  }
}

TEST(OddNumber, isNamedByItsPlace) {
  const Channel goal = kArm;
  EXPECT_EQ(oddNumber(schemaOf(goal), trajectory(goal, "goal.trajectory.", std::nan(""))),
            "goal.trajectory.points[0].velocities[0] is nan");
  EXPECT_EQ(oddNumber(schemaOf(kCmdVel), twist(1)), "");
  EXPECT_EQ(oddNumber(schemaOf(channelOf("/any", "std_msgs/Float64MultiArray", kMultiArray)),
                      group({0, -std::numeric_limits<double>::infinity()})),
            "data[1] is -inf");
  const auto odd = [](const std::string& fields, FieldType type, const auto& number) {
    const Channel channel = channelOf("/any", "test/Numbers", fields);
    NumberArray numbers{type, Bytes(2 * sizeof number)};
    std::memcpy(numbers.bytes.data() + sizeof number, &number, sizeof number);
    return oddNumber(schemaOf(channel), with(channel, "data", numbers));
  };
  EXPECT_EQ(odd("float32[] data\n", FieldType::Float32, std::numeric_limits<float>::infinity()),
            "data[1] is inf");
  EXPECT_EQ(odd("float32[] data\n", FieldType::Float32, 1.F), "");
  EXPECT_EQ(odd("int32[] data\n", FieldType::Int32, std::int32_t{-1}), "")
      << "every whole number is one";
}

// --------------------------------------------------------------------------------- what stops them

MotionStop ruleOf(StopKind kind) {
  MotionStop stop;
  stop.kind = kind;
  stop.rule = "rules.yaml:3";
  return stop;
}

TEST(StopMaker, keepsTheSteering) {
  const Channel channel = channelOf("/ackermann_cmd", "ackermann_msgs/AckermannDrive", kAckermann);
  const StopMaker maker(channel, stopOf(plannedTopic(channel)));
  EXPECT_EQ(maker.after(drive(0.3F, 1.5F, 2)), drive(0.3F, 0));
  EXPECT_TRUE(maker.isNeutral(drive(0.3F, 0)));
  EXPECT_FALSE(maker.isNeutral(drive(0.3F, -0.1F)));
}

TEST(StopMaker, sendsAsManyZerosAsThereWereNumbers) {
  const Channel channel =
      channelOf("/joint_group_vel_controller/command", "std_msgs/Float64MultiArray", kMultiArray);
  const StopMaker maker(channel, stopOf(plannedTopic(channel)));
  EXPECT_EQ(maker.after(group({0.1, -0.2, 0.3})), group({0, 0, 0}));
  EXPECT_TRUE(maker.isNeutral(group({0, -0.0})));
  EXPECT_THROW(maker.after(Bytes(3)), MessageError);
  EXPECT_FALSE(maker.isNeutral(Bytes(3)));
}

TEST(StopMaker, hasNothingToSendForWhatStopsOrEndsByItself) {
  const Channel channel = channelOf("/runstop", "std_msgs/Bool", "bool data\n");
  for (const StopKind kind : {StopKind::IsStop, StopKind::EndsItself}) {
    const StopMaker maker(channel, ruleOf(kind));
    EXPECT_FALSE(maker.hasMessage());
    EXPECT_TRUE(maker.before().empty());
    EXPECT_TRUE(maker.after({1}).empty());
    EXPECT_EQ(maker.isNeutral({1}), kind == StopKind::IsStop);
  }
}

TEST(StopMaker, setsTheFieldsThatARuleNames) {
  const Channel channel = channelOf(
      "/my_drive", "my_msgs/Drive",
      withTypes("float64 speed\nbool brakes\nuint8 gear\nWheel[] wheels\n", "my_msgs/Wheel",
                "int16 turn\n"));
  MotionStop stop = ruleOf(StopKind::Fields);
  stop.fields = {{"speed", 0}, {"brakes", 1}, {"wheels[].turn", 0}};
  EXPECT_NO_THROW(checkStop(stop, schemaOf(channel)));
  const Schema schema = schemaOf(channel);
  Value moving = blank(channel);
  Value wheel = Object{{"turn", std::int16_t{-7}}};
  test::at(moving, "speed") = 1.5;
  test::at(moving, "gear") = std::uint8_t{2};
  test::at(moving, "wheels") = Array{wheel, wheel};
  Value halted = decode(schema, StopMaker(channel, stop).after(encode(schema, moving)));
  EXPECT_EQ(std::get<double>(test::at(halted, "speed")), 0);
  EXPECT_EQ(std::get<BoolByte>(test::at(halted, "brakes")).byte, 1);
  EXPECT_EQ(std::get<std::uint8_t>(test::at(halted, "gear")), 2) << "not named";
  for (Value& one : std::get<Array>(test::at(halted, "wheels"))) {
    EXPECT_EQ(std::get<std::int16_t>(test::at(one, "turn")), 0);
  }
}

TEST(MotionStop, isToldInAClauseWithTheRuleThatSaysSo) {
  const auto told = [](StopKind kind) { return describe(ruleOf(kind)); };
  EXPECT_EQ(describe(MotionStop()), "nothing stops it that is known");
  EXPECT_EQ(told(StopKind::Zero), "zeros stop it (rules.yaml:3)");
  EXPECT_EQ(told(StopKind::Speed), "speed 0 stops it, its steering is kept (rules.yaml:3)");
  EXPECT_EQ(told(StopKind::NoPoints), "a trajectory without points stops it (rules.yaml:3)");
  EXPECT_EQ(told(StopKind::Cancel), "a cancel stops it (rules.yaml:3)");
  EXPECT_EQ(told(StopKind::EndsItself), "it stops where it is told to go (rules.yaml:3)");
  EXPECT_EQ(told(StopKind::IsStop), "it is a stop itself");
  MotionStop stop = ruleOf(StopKind::Fields);
  stop.fields = {{"gait", 2}, {"speed", 0.5}};
  EXPECT_EQ(describe(stop), "gait 2, speed 0.5 stops it (rules.yaml:3)");
  stop = {StopKind::Cancel, "/move/cancel", {}, ""};
  EXPECT_EQ(describe(stop), "a cancel on /move/cancel stops it");
}

TEST(MotionStop, refusesRulesThatDoNotFitTheType) {
  const auto whyNot = [](const MotionStop& stop, const Channel& channel) -> std::string {
    try {
      checkStop(stop, schemaOf(channel));
      return "";
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  };
  const Channel text = channelOf("/say", "std_msgs/String", "string data\n");
  EXPECT_EQ(whyNot(ruleOf(StopKind::Zero), text),
            "rules.yaml:3: std_msgs/String has no number to set to zero");
  EXPECT_EQ(whyNot(ruleOf(StopKind::NoPoints), text),
            "rules.yaml:3: std_msgs/String is no trajectory");
  MotionStop fields = ruleOf(StopKind::Fields);
  fields.fields = {{"speed", 0}};
  EXPECT_EQ(whyNot(fields, text), "rules.yaml:3: std_msgs/String has no field speed");
  fields.fields = {{"data", 0}};
  EXPECT_EQ(whyNot(fields, text),
            "rules.yaml:3: data of std_msgs/String is a string, which 0 does not fit");
  EXPECT_EQ(whyNot(ruleOf(StopKind::Zero), kArm),
            "rules.yaml:3: a cancel stops a control_msgs/FollowJointTrajectoryActionGoal, write "
            "{cancel: /TOPIC}");
  EXPECT_EQ(whyNot(ruleOf(StopKind::Zero), kCmdVel), "");
}

TEST(MotionStop, setsAFieldToNumbersThatItsTypeHolds) {
  const auto fits = [](const std::string& type, double value) {
    MotionStop stop = ruleOf(StopKind::Fields);
    stop.fields = {{"speed", value}};
    try {
      checkStop(stop, schemaOf(channelOf("/drive", "my_msgs/Drive", type + " speed\n")));
      return true;
    } catch (const std::invalid_argument&) {
      return false;
    }
  };
  const std::vector<std::tuple<std::string, double, double>> ranges = {
      {"bool", 0, 1},           {"int8", -128, 127},  {"uint8", 0, 255},
      {"int16", -32768, 32767}, {"uint16", 0, 65535}, {"uint32", 0, 4294967295}};
  for (const auto& [type, least, most] : ranges) {
    EXPECT_TRUE(fits(type, least) && fits(type, most)) << type;
    EXPECT_FALSE(fits(type, least - 1) || fits(type, most + 1) || fits(type, most - 0.5)) << type;
  }
  EXPECT_TRUE(fits("float64", -0.5));
}

// ------------------------------------------------------------------------------------- in a plan

struct StopRules : PlayerWorld {
  void SetUp() override { record(wheel, 0, with(wheel, "data", 0.5)); }
  PlannedTopic planned() {
    play(100);
    return plan.topics.at(0);
  }
  const Channel wheel = channelOf("/wheel_left/effort", "std_msgs/Float64", "float64 data\n");
};

TEST_F(StopRules, makeBodyOfWhatNothingIsKnownToStop) {
  PlannedTopic topic = planned();
  EXPECT_EQ(topic.topic_class, TopicClass::Endless);
  EXPECT_FALSE(topic.isPlayed());
  plan_options.rewriting.stops[wheel.topic] = ruleOf(StopKind::Zero);
  topic = planned();
  EXPECT_EQ(topic.topic_class, TopicClass::Body);
  EXPECT_EQ(topic.why_class, "zeros stop it (rules.yaml:3)");
  EXPECT_TRUE(topic.isPlayed());
  EXPECT_EQ(plan.motionTopics(), std::vector<std::string>{wheel.topic}) << "behind --allow-motion";
  EXPECT_EQ(whyOnlyAsRecorded(plan).find(wheel.topic + ": what of std_msgs/Float64 is a velocity"),
            0u);
}

TEST_F(StopRules, doNotOpenAPersonsInput) {
  const Channel teleop = twistChannel("/teleop/cmd_vel");
  record(teleop, 0, twist(1));
  plan_options.rewriting.stops[teleop.topic] = ruleOf(StopKind::Zero);
  plan_options.topics = {wheel.topic};
  play(100);
  for (const PlannedTopic& topic : plan.topics) {
    const bool is_person = topic.channel.topic == teleop.topic;
    EXPECT_EQ(topic.topic_class, is_person ? TopicClass::Control : TopicClass::Endless);
  }
}

TEST_F(StopRules, areRefusedWithTheirLineWhereTheyDoNotFit) {
  plan_options.rewriting.stops[wheel.topic] = ruleOf(StopKind::NoPoints);
  try {
    play(100);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "rules.yaml:3: std_msgs/Float64 is no trajectory");
  }
}

// ------------------------------------------------------------------------------------- as played

using StoppedReplay = PlayerWorld;

const Channel kGroup =
    channelOf("/joint_group_vel_controller/command", "std_msgs/Float64MultiArray", kMultiArray);

TEST_F(StoppedReplay, stopsAControllerWithoutTimeoutInAPauseAndAtTheEnd) {
  record(kGroup, 0, group({0.1, -0.2}));
  at(1000, [this] { player->pause(); });
  at(2000, [this] { player->resume(); });
  play(3000);
  const std::vector<Sent> sent = sink.on(kGroup.topic);
  ASSERT_GE(sent.size(), 4u);
  EXPECT_EQ(sent[1].at_ms, 1000);
  EXPECT_EQ(sent[1].bytes, group({0, 0}));
  EXPECT_EQ(sent[2].at_ms, 2000);
  EXPECT_EQ(sent[2].bytes, group({0.1, -0.2})) << "it is in force however long ago it came";
  EXPECT_EQ(sent.back().at_ms, 4000);
  EXPECT_EQ(sent.back().bytes, group({0, 0}));
}

TEST_F(StoppedReplay, cancelsATargetThatARuleSaysHowToCancel) {
  const Channel goal = channelOf("/move_base_simple/goal", "geometry_msgs/PoseStamped",
                                 kPoseStamped);
  record(goal, 0, encode(schemaOf(goal), blank(goal)));
  MotionStop stop = ruleOf(StopKind::Cancel);
  stop.cancel_topic = "/move_base/cancel";
  plan_options.rewriting.stops[goal.topic] = stop;
  at(1000, [this] { player->pause(); });
  at(2000, [this] { player->resume(); });
  play(3000);
  EXPECT_EQ(sink.times(goal.topic), (Times{0, 2000}));
  EXPECT_EQ(sink.times("/move_base/cancel"), (Times{1000, 4000}));
  EXPECT_EQ(sink.on("/move_base/cancel").back().bytes, cancelMessage(""));
}

TEST_F(StoppedReplay, neverCancelsAGripperThatWouldLetGo) {
  const Kind gripper = kinds().at("pr2_controllers_msgs/Pr2GripperCommand*");
  record(gripper.channel, 0, gripper.moving(0.02));
  at(500, [this] { player->stop("enough"); });
  play(1000);
  EXPECT_EQ(sink.sent.size(), 1u);
}

// --------------------------------------------------------------------------------- aborted goals

TEST(AbortedGoals, areHaltedByATrajectoryWithoutPoints) {
  PlayPlan plan;
  plan.topics = {plannedTopic(kArm)};
  MotionMonitor watch(plan);
  ASSERT_EQ(watch.outputs().size(), 2u);
  EXPECT_EQ(watch.outputs()[1].channel.topic, "/arm/command");
  watch.sending(kArm, goalMessage("a", {1}));
  watch.goals().finish("a", GoalOutcome::Failed, {});
  const MotionMonitor::End end = watch.goalEnded("a");
  ASSERT_TRUE(end.halt);
  EXPECT_EQ(watch.moving(), Outputs{1}) << "the controller may go on with it";
  EXPECT_FALSE(watch.goalEnded("a").halt) << "its status is seen again and again";
  watch.sending(end.halt->channel, end.halt->stop);
  EXPECT_TRUE(watch.moving().empty());
}

TEST(AbortedGoals, areNotHaltedWhereTheyEndedWellOrAnotherOneCame) {
  PlayPlan plan;
  plan.topics = {plannedTopic(kArm)};
  MotionMonitor watch(plan);
  watch.sending(kArm, goalMessage("a", {1}));
  watch.goals().finish("a", GoalOutcome::Succeeded, {});
  EXPECT_FALSE(watch.goalEnded("a").halt);
  watch.sending(kArm, goalMessage("b", {1}));
  watch.sending(kArm, goalMessage("c", {1}));
  watch.goals().finish("b", GoalOutcome::Failed, {});
  EXPECT_FALSE(watch.goalEnded("b").halt) << "it would end the next one";
}

// -------------------------------------------------------------------------------------- grippers

TEST(Gripper, isStoppedByAGoalAtItsGapOnceThatIsKnown) {
  const Kind gripper = kinds().at("control_msgs/GripperCommandActionGoal");
  PlayPlan plan;
  plan.topics = {plannedTopic(gripper.channel)};
  MotionMonitor watch(plan);
  EXPECT_FALSE(watch.gapMeasured(0.1)) << "it stands";
  Value goal = decode(schemaOf(gripper.channel), gripper.moving(0.02));
  test::at(goal, "goal_id.id") = std::string("close");
  watch.sending(gripper.channel, encode(schemaOf(gripper.channel), goal));
  EXPECT_EQ(watch.moving(), Outputs{0}) << "by a cancel";
  EXPECT_FALSE(watch.sending(cancelChannel(kArm), Bytes(10)).has_changed) << "of another action";
  EXPECT_FALSE(watch.gapMeasured(std::nan("")));
  EXPECT_EQ(watch.moving(), Outputs{0}) << "its gap is not known yet";
  EXPECT_TRUE(watch.gapMeasured(0.07));
  EXPECT_EQ(watch.moving(), Outputs{1});
  EXPECT_FALSE(watch.gapMeasured(0.0702)) << "nearly the same";
  const MotionMonitor::Output hold = watch.outputs()[1];
  EXPECT_EQ(hold.channel.topic, gripper.channel.topic);
  Value told = decode(schemaOf(hold.channel), hold.stop);
  EXPECT_EQ(std::get<double>(test::at(told, "goal.command.position")), 0.07);
  EXPECT_EQ(std::get<std::string>(test::at(told, "goal_id.id")), "close-hold");
  const auto change = watch.sending(cancelChannel(gripper.channel), cancelMessage("close"));
  ASSERT_TRUE(change.instead) << "a cancel would leave it moving";
  EXPECT_EQ(change.instead->stop, hold.stop);
  EXPECT_TRUE(watch.moving().empty());
}

TEST(AbortedGoals, haltMessageIsATrajectory) {
  const Channel channel = *haltChannel(kArm);
  EXPECT_TRUE(fits(schemaOf(channel), haltMessage()));
  EXPECT_FALSE(haltChannel(kGripper));
}

}  // namespace
}  // namespace afterglow::replay::motion_stop_test

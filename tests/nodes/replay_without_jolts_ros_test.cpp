// Nothing that a replay sends has a command step: after cancels, pauses, seeks, and where somebody
// has moved the arm. On the fake Fetch, whose controllers take goals as the real one's do, each
// node a process of its own.
#include <actionlib/client/simple_action_client.h>
#include <afterglow/ReplayAction.h>
#include <afterglow/Seek.h>
#include <afterglow/StartRecording.h>
#include <afterglow/StopRecording.h>
#include <control_msgs/FollowJointTrajectoryAction.h>
#include <control_msgs/PointHeadAction.h>
#include <gtest/gtest.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <atomic>
#include <boost/make_shared.hpp>
#include <chrono>
#include <cmath>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "nodes/fetch/fetch_facts.hpp"
#include "nodes/player/robot_services.hpp"
#include "tests/support/fetch_witness.hpp"
#include "tests/support/node_process.hpp"
#include "tests/support/ros_master.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::replay_without_jolts_ros_test {
namespace {

using test::ArmPose;
using test::eventually;
using test::kArmAction;
using State = actionlib::SimpleClientGoalState;
using Arm = actionlib::SimpleActionClient<control_msgs::FollowJointTrajectoryAction>;
using Head = actionlib::SimpleActionClient<control_msgs::PointHeadAction>;
using Player = actionlib::SimpleActionClient<ReplayAction>;

const ros::Duration kPatience(40);
const std::string kHeadAction = "/head_controller/point_head";
/// Of a command within a cycle of 10 ms, rad. The fastest that is recorded here goes 0.008, and a
/// replay may take a goal up from where it is a little faster.
constexpr double kJolt = 0.03;
/// How long robots wait here between a cancel and the next goal: their controllers make good in one
/// step what has passed meanwhile.
const ros::WallDuration kLongPause(3);
constexpr double kDegree = 3.14159265358979323846 / 180;

const ArmPose kTucked = {0.0, 1.32, 1.4, -0.2, 1.72, 0.0, 1.66, 0.0};
const ArmPose kFar = {0.05, 0.32, 0.4, 0.3, 1.0, 0.4, 1.2, 0.4};  // about 1 rad from there

template <typename Service>
typename Service::Response call(const std::string& name,
                                const typename Service::Request& request = {}) {
  Service service;
  service.request = request;
  EXPECT_TRUE(ros::service::waitForService(name, kPatience)) << name;
  EXPECT_TRUE(ros::service::call(name, service)) << name;
  return service.response;
}

trajectory_msgs::JointTrajectoryPoint point(double seconds, const ArmPose& positions) {
  trajectory_msgs::JointTrajectoryPoint point;
  point.positions = positions;
  point.time_from_start = ros::Duration(seconds);
  return point;
}

/// As MoveIt sends it: from where the arm stands, at time 0, densely and smoothly.
control_msgs::FollowJointTrajectoryGoal denseGoal(const ArmPose& from, const ArmPose& to,
                                                  double seconds) {
  constexpr int kPoints = 20;
  control_msgs::FollowJointTrajectoryGoal goal;
  goal.trajectory.joint_names = kArmWithTorsoJoints;
  for (int i = 0; i < kPoints; ++i) {
    const double s = i / (kPoints - 1.);
    const double way = s * s * (3 - 2 * s), speed = 6 * s * (1 - s) / seconds;
    goal.trajectory.points.push_back(point(s * seconds, from));
    for (std::size_t k = 0; k < from.size(); ++k) {
      goal.trajectory.points.back().positions[k] += way * (to[k] - from[k]);
      goal.trajectory.points.back().velocities.push_back(speed * (to[k] - from[k]));
    }
  }
  return goal;
}

control_msgs::FollowJointTrajectoryGoal sparseGoal() {
  control_msgs::FollowJointTrajectoryGoal goal;
  goal.trajectory.joint_names = kArmWithTorsoJoints;
  goal.trajectory.points = {point(1.2, {0.02, 1.0, 1.0, -0.2, 1.5, 0.2, 1.4, 0.3}),
                            point(2.4, {0.05, 0.5, 0.6, 0.1, 1.2, 0.4, 1.2, 0.5}),
                            point(3.6, {0.05, 0.2, 0.6, 0.3, 1.0, 0.2, 1.0, 0.2})};
  return goal;
}

control_msgs::FollowJointTrajectoryGoal singleGoal() {
  control_msgs::FollowJointTrajectoryGoal goal;
  goal.trajectory.joint_names = kArmWithTorsoJoints;
  goal.trajectory.points = {point(3, kFar)};
  goal.trajectory.points[0].velocities.assign(kFar.size(), 0);
  return goal;
}

control_msgs::PointHeadGoal headGoal() {
  control_msgs::PointHeadGoal goal;
  goal.target.header.frame_id = "base_link";
  goal.target.point.x = 0.3;
  goal.target.point.y = 1;
  goal.target.point.z = 1;
  goal.pointing_frame = "head_tilt_link";
  goal.pointing_axis.x = 1;
  goal.min_duration = ros::Duration(3);
  return goal;
}

struct World {
  World() {
    node = std::make_unique<ros::NodeHandle>();
    node->setParam("/robot_description", test::fileBytes("assets/fetch.urdf"));
    robot = start({AFTERGLOW_TEST_FAKE_FETCH_NODE});
    recorder = start({AFTERGLOW_TEST_RECORDER_NODE, "_store:=" + store});
    player = start({AFTERGLOW_TEST_PLAYER_NODE, "_store:=" + store, "_allow_motion:=true",
                    "_longest_stall:=1", "_hold:=0"});
    spinner.start();
    witness = std::make_unique<test::FetchWitness>();
    hand = node->advertise<sensor_msgs::JointState>("/fake_fetch/hand", 1);
    arm = std::make_unique<Arm>(kArmAction, false);
    head = std::make_unique<Head>(kHeadAction, false);
    replay = std::make_unique<Player>("/replay", false);
    EXPECT_TRUE(arm->waitForServer(kPatience) && head->waitForServer(kPatience) &&
                replay->waitForServer(kPatience));
  }
  ~World() {
    arm.reset();
    head.reset();
    replay.reset();
    spinner.stop();
    ros::shutdown();
  }
  static std::unique_ptr<test::NodeProcess> start(const std::vector<std::string>& arguments) {
    return std::make_unique<test::NodeProcess>(arguments);
  }

  test::TempFolder folder;
  std::string store = folder.path("behaviors.db");
  test::TestGraph graph;
  std::unique_ptr<ros::NodeHandle> node;
  std::unique_ptr<test::NodeProcess> robot, recorder, player;
  std::unique_ptr<test::FetchWitness> witness;
  ros::Publisher hand;
  std::unique_ptr<Arm> arm;
  std::unique_ptr<Head> head;
  std::unique_ptr<Player> replay;
  ros::AsyncSpinner spinner{2};
};

struct ReplayWithoutJolts : testing::Test {
  static void SetUpTestSuite() { world = new World; }
  static void TearDownTestSuite() { delete world; }
  ReplayWithoutJolts() { putBack(); }
  ~ReplayWithoutJolts() override {
    world->replay->cancelAllGoals();
    if (!world->replay->getState().isDone()) world->replay->waitForResult(kPatience);
  }

  static test::FetchWitness& witness() { return *world->witness; }

  void putBack() {
    ASSERT_TRUE(call<std_srvs::Trigger>("/fake_fetch/reset").success);
    ASSERT_TRUE(eventually([] {
      return isAt(kTucked, 1e-6) && std::abs(witness().joint("head_pan_joint")) < 1e-6;
    }));
    witness().forget();
  }

  static ArmPose armNow() {
    ArmPose pose;
    for (const std::string& joint : kArmWithTorsoJoints) pose.push_back(witness().joint(joint));
    return pose;
  }
  static bool isAt(const ArmPose& there, double tolerance) {
    const ArmPose now = armNow();
    for (std::size_t k = 0; k < there.size(); ++k)
      if (!(std::abs(now[k] - there[k]) <= tolerance)) return false;
    return true;
  }

  /// What it does once, recorded; then the robot is put back.
  std::int64_t recorded(const std::string& topic, const std::function<void()>& perform) {
    const std::int64_t behavior = recordedHere(topic, perform);
    putBack();
    return behavior;
  }
  /// The robot stays where it ends.
  static std::int64_t recordedHere(const std::string& topic, const std::function<void()>& perform) {
    StartRecording::Request request;
    request.name = "reach";
    request.topics = {topic};
    const auto started = call<StartRecording>("/recorder_node/start_recording", request);
    EXPECT_TRUE(started.success) << started.message;
    perform();
    StopRecording::Request stop;
    stop.outcome = "success";
    EXPECT_TRUE(call<StopRecording>("/recorder_node/stop_recording", stop).success);
    recorded_step = witness().largestStep().first;
    return started.behavior_id;
  }
  std::int64_t recordedArm(const control_msgs::FollowJointTrajectoryGoal& goal) {
    return recorded(kArmAction + "/goal", [&] {
      EXPECT_EQ(world->arm->sendGoalAndWait(goal, kPatience), State::SUCCEEDED);
    });
  }

  static void play(std::int64_t behavior, double start = 0) {
    ReplayGoal goal;
    goal.behavior = std::to_string(behavior);
    goal.options = {"start=" + std::to_string(start)};
    world->replay->sendGoal(goal);
  }
  static State replayEnd() {
    EXPECT_TRUE(world->replay->waitForResult(kPatience));
    return world->replay->getState();
  }

  /// Plays until `joint` has gone half of its way to `end`, and pauses there for long.
  static void pauseHalfWay(std::int64_t behavior, const std::string& joint, double end) {
    const double begin = witness().joint(joint);
    play(behavior);
    ASSERT_TRUE(eventually([&] {
      return std::abs(witness().joint(joint) - begin) > std::abs(end - begin) / 2;
    })) << world->replay->getState().getText();
    ASSERT_TRUE(call<std_srvs::Trigger>("/player_node/pause").success);
    kLongPause.sleep();
    ASSERT_GT(std::abs(witness().joint(joint) - end), 0.1 * std::abs(end - begin))
        << "the pause came when all was over: this machine is too busy to tell";
  }
  static void seekInThePause(const std::string& player, double position) {
    Seek::Request there;
    there.position = position;
    ASSERT_TRUE(call<Seek>(player + "/seek", there).success);
    ASSERT_TRUE(call<std_srvs::Trigger>(player + "/resume").success);
  }
  static void resume() { ASSERT_TRUE(call<std_srvs::Trigger>("/player_node/resume").success); }

  static void expectNoJolt(const std::string& when) {
    const auto [step, joint] = witness().largestStep();
    std::cout << when << ": the largest command step is " << step << " rad (" << joint << ")\n";
    EXPECT_GT(step, 0) << when << ": nothing was commanded";
    EXPECT_LE(step, kJolt) << when << ": " << joint;
  }
  /// Nor was it faster than it was recorded, but for the noise of a controller's cycles.
  static void expectNoFaster(const std::string& when) {
    expectNoJolt(when);
    EXPECT_LE(witness().largestStep().first, 1.2 * recorded_step) << when;
  }

  /// Somebody turns the arm at its shoulder.
  static double turnArm(double by) {
    EXPECT_TRUE(eventually([] { return world->hand.getNumSubscribers() > 0; }));
    sensor_msgs::JointState there;
    there.name = {"shoulder_pan_joint"};
    there.position = {witness().joint("shoulder_pan_joint") + by};
    world->hand.publish(there);
    EXPECT_TRUE(eventually([&] {
      return std::abs(witness().joint("shoulder_pan_joint") - there.position[0]) < 1e-6;
    }));
    return there.position[0];
  }
  /// It was not played on, and the arm is where it was put.
  static void expectRefusal(const std::string& when, double shoulder) {
    const State end = replayEnd();
    const auto [step, joint] = witness().largestStep();
    std::cout << when << ": " << end.toString() << " '" << end.getText()
              << "', the largest command step is " << step << " rad (" << joint << ")\n";
    EXPECT_EQ(end, State::ABORTED) << when;
    EXPECT_LE(step, kJolt) << when << ": " << joint;
    EXPECT_NEAR(witness().joint("shoulder_pan_joint"), shoulder, 0.01) << when;
  }

  static inline World* world = nullptr;
  static inline double recorded_step = 0;  ///< the largest, of the last recording
};

TEST_F(ReplayWithoutJolts, goesToTheStartAsSlowlyAfterACancelAsBefore) {
  const std::int64_t behavior = recordedArm(denseGoal(kTucked, kFar, 2));
  world->arm->sendGoal(denseGoal(kTucked, kFar, 4));
  ASSERT_TRUE(eventually([] { return witness().joint("shoulder_lift_joint") < 0.8; }));
  world->arm->cancelGoal();
  ASSERT_TRUE(world->arm->waitForResult(kPatience));
  ASSERT_EQ(world->arm->getState(), State::PREEMPTED);
  kLongPause.sleep();
  witness().forget();
  test::NodeProcess command({AFTERGLOW_TEST_COMMAND, "play", std::to_string(behavior), "--store",
                             world->store, "--allow-motion", "--to-start",
                             "--unchecked-approach", "--quiet", "--no-keys", "--longest-stall",
                             "1"});
  EXPECT_EQ(command.exitStatus(), 0) << command.log();
  EXPECT_TRUE(eventually([] { return isAt(kFar, 0.01); }));
  expectNoJolt("--to-start after a cancel");
}

/// MoveIt's service, with an MD5 of some version of it.
ros::ServiceServer advertiseMoveIt(
    const std::function<bool(const StateValidityRequest& request)>& isFree) {
  using Spec = ros::ServiceSpec<StateValidityRequest, StateValidityResponse>;
  ros::AdvertiseServiceOptions options;
  options.service = "/check_state_validity";
  options.md5sum = "0123456789abcdef0123456789abcdef";
  options.datatype = "moveit_msgs/GetStateValidity";
  options.req_datatype = options.datatype + "Request";
  options.res_datatype = options.datatype + "Response";
  options.helper = boost::make_shared<ros::ServiceCallbackHelperT<Spec>>(
      [isFree](StateValidityRequest& request, StateValidityResponse& response) {
        response.valid = isFree(request);
        return true;
      });
  return ros::NodeHandle().advertiseService(options);
}

TEST_F(ReplayWithoutJolts, goesFarToTheStartOnlyByAWayThatWasRecordedOrThatMoveItFindsFree) {
  ArmPose corner = kTucked;
  corner[4] -= 0.3;  // the elbow, first
  ArmPose start = corner;
  start[1] -= 0.3;  // then the shoulder
  ArmPose end = start;
  end[7] += 0.1;
  const auto go = [](const ArmPose& from, const ArmPose& to) {
    EXPECT_EQ(world->arm->sendGoalAndWait(denseGoal(from, to, 0.5), kPatience), State::SUCCEEDED);
  };
  recordedHere(kArmAction + "/goal", [&] {
    go(kTucked, corner);
    go(corner, start);
  });
  const std::int64_t behavior = recordedHere(kArmAction + "/goal", [&] { go(start, end); });
  const auto playFromHere = [&] {
    test::NodeProcess command({AFTERGLOW_TEST_COMMAND, "play", std::to_string(behavior), "--store",
                               world->store, "--allow-motion", "--to-start", "--quiet", "--no-keys",
                               "--longest-stall", "1"});
    const int status = command.exitStatus();
    return std::pair(status, command.log());
  };
  putBack();
  const auto [status, log] = playFromHere();
  EXPECT_EQ(status, 0) << log;
  EXPECT_TRUE(eventually([&] { return isAt(end, 0.01); }));
  EXPECT_LT(test::farthest(witness().armPath(), {kTucked, corner, start, end}), 0.03)
      << "round the same corner";
  expectNoJolt("--to-start as recorded");

  putBack();
  const double shoulder = turnArm(-0.8);  // nothing was recorded from there
  witness().forget();
  const auto [refused, why] = playFromHere();
  EXPECT_EQ(refused, 1);
  EXPECT_NE(why.find("shoulder_pan_joint by 0.50 rad"), std::string::npos) << why;
  EXPECT_NE(why.find("on a way that nobody has checked"), std::string::npos) << why;
  EXPECT_NEAR(witness().joint("shoulder_pan_joint"), shoulder, 0.01);

  std::atomic<int> asked{0};
  const ros::ServiceServer moveit = advertiseMoveIt([&](const StateValidityRequest& request) {
    ++asked;
    return request.is_diff != 0 && request.joint_state.name == kArmWithTorsoJoints;
  });
  const auto [checked, told] = playFromHere();
  EXPECT_EQ(checked, 0) << told;
  EXPECT_GE(asked, 10) << "every 0.05 rad";
  EXPECT_TRUE(eventually([&] { return isAt(end, 0.01); }));
}

TEST_F(ReplayWithoutJolts, goesOnWithADenseTrajectoryAfterALongPause) {
  const std::int64_t behavior = recordedArm(denseGoal(kTucked, kFar, 3));
  pauseHalfWay(behavior, "shoulder_lift_joint", kFar[2]);
  resume();
  EXPECT_EQ(replayEnd(), State::SUCCEEDED);
  EXPECT_TRUE(eventually([] { return isAt(kFar, 0.01); }));
  expectNoFaster("a dense trajectory resumed");
}

TEST_F(ReplayWithoutJolts, goesOnWithASparseTrajectoryAfterALongPauseOnItsPath) {
  const std::int64_t behavior = recordedArm(sparseGoal());
  std::vector<ArmPose> path = {kTucked};
  for (const auto& point : sparseGoal().trajectory.points) path.push_back(point.positions);
  pauseHalfWay(behavior, "shoulder_pan_joint", path.back()[1]);
  resume();
  EXPECT_EQ(replayEnd(), State::SUCCEEDED);
  EXPECT_TRUE(eventually([&] { return isAt(path.back(), 0.01); }));
  expectNoFaster("a sparse trajectory resumed");
  const double off = test::farthest(witness().armPath(), path) / kDegree;
  std::cout << "a sparse trajectory resumed: " << off << " degrees off its path\n";
  EXPECT_LT(off, 1);
}

TEST_F(ReplayWithoutJolts, goesOnWithATrajectoryOfOnePointAfterALongPause) {
  const std::int64_t behavior = recordedArm(singleGoal());
  pauseHalfWay(behavior, "shoulder_lift_joint", kFar[2]);
  resume();
  EXPECT_EQ(replayEnd(), State::SUCCEEDED);
  EXPECT_TRUE(eventually([] { return isAt(kFar, 0.01); }));
  expectNoFaster("a trajectory of one point resumed");
}

TEST_F(ReplayWithoutJolts, goesOnFromInsideAGoalNoFasterThanItWasRecorded) {
  constexpr double kLength = 4, kGoalSent = 0.03;  // s, the latter after the recording's begin
  const std::int64_t behavior = recordedArm(denseGoal(kTucked, kFar, kLength));
  pauseHalfWay(behavior, "shoulder_lift_joint", kFar[2]);
  const double lift = witness().joint("shoulder_lift_joint");
  const double gone = (kTucked[2] - lift) / (kTucked[2] - kFar[2]);
  world->replay->cancelAllGoals();
  replayEnd();
  witness().forget();
  // Where it stands is where it was then: the way is 3 s^2 - 2 s^3 of the goal's time.
  double s = 0;
  while (s * s * (3 - 2 * s) < gone) s += 0.001;
  play(behavior, kGoalSent + kLength * s);
  EXPECT_EQ(replayEnd(), State::SUCCEEDED) << world->replay->getState().getText();
  EXPECT_TRUE(eventually([] { return isAt(kFar, 0.01); }));
  expectNoFaster("from inside a goal");
}

TEST_F(ReplayWithoutJolts, cancelsAGoalThatWasCanceledWhenItWasRecordedWhereItWasThen) {
  ArmPose stood;
  const std::int64_t behavior = recorded(kArmAction + "/goal", [&] {
    world->arm->sendGoal(denseGoal(kTucked, kFar, 4));
    ASSERT_TRUE(eventually([] { return witness().joint("shoulder_lift_joint") < 1.0; }));
    world->arm->cancelGoal();
    ASSERT_TRUE(world->arm->waitForResult(kPatience));
    ros::WallDuration(0.5).sleep();
    stood = armNow();
  });
  play(behavior);
  EXPECT_EQ(replayEnd(), State::SUCCEEDED) << world->replay->getState().getText();
  EXPECT_GT(std::abs(kFar[2] - witness().joint("shoulder_lift_joint")), 0.3);
  EXPECT_TRUE(isAt(stood, 0.06)) << witness().joint("shoulder_lift_joint") << ", then " << stood[2];
  expectNoFaster("a canceled goal");
}

TEST_F(ReplayWithoutJolts, goesOnWithALookAfterALongPause) {
  double pan = 0;
  const std::int64_t behavior = recorded(kHeadAction + "/goal", [&] {
    EXPECT_EQ(world->head->sendGoalAndWait(headGoal(), kPatience), State::SUCCEEDED);
    ros::WallDuration(0.1).sleep();  // until it is published
    pan = witness().joint("head_pan_joint");
  });
  ASSERT_GT(pan, 0.5);
  pauseHalfWay(behavior, "head_pan_joint", pan);
  resume();
  EXPECT_EQ(replayEnd(), State::SUCCEEDED);
  EXPECT_TRUE(
      eventually([&] { return std::abs(witness().joint("head_pan_joint") - pan) < 0.02; }));
  expectNoJolt("a look resumed");
}

TEST_F(ReplayWithoutJolts, isStoppedAfterASeekToWhereTheArmIsNot) {
  const std::int64_t behavior = recordedArm(denseGoal(kTucked, kFar, 4));
  const double shoulder = witness().joint("shoulder_pan_joint");
  pauseHalfWay(behavior, "shoulder_lift_joint", kFar[2]);
  const double halted = witness().joint("shoulder_pan_joint");
  ASSERT_GT(std::abs(halted - shoulder), 0.3);
  seekInThePause("/player_node", 0.2);
  expectRefusal("sought and resumed", halted);
}

TEST_F(ReplayWithoutJolts, seeksInAPauseAndGoesThereSlowlyFirstIfItMay) {
  const std::int64_t behavior = recordedArm(denseGoal(kTucked, kFar, 4));
  const auto player = World::start({AFTERGLOW_TEST_PLAYER_NODE, "__name:=player_there",
                                    "replay:=replay_there", "_store:=" + world->store,
                                    "_allow_motion:=true", "_to_start:=true",
                                    "_unchecked_approach:=true", "_longest_stall:=1", "_hold:=0"});
  Player replay("/replay_there", false);
  ASSERT_TRUE(replay.waitForServer(kPatience));
  ReplayGoal goal;
  goal.behavior = std::to_string(behavior);
  const double begin = witness().joint("shoulder_lift_joint");
  replay.sendGoal(goal);
  ASSERT_TRUE(eventually([&] {
    return std::abs(witness().joint("shoulder_lift_joint") - begin) > 0.5;
  })) << replay.getState().getText();
  ASSERT_TRUE(call<std_srvs::Trigger>("/player_there/pause").success);
  kLongPause.sleep();
  seekInThePause("/player_there", 0.2);
  EXPECT_TRUE(replay.waitForResult(kPatience));
  EXPECT_EQ(replay.getState(), State::SUCCEEDED) << replay.getState().getText();
  EXPECT_TRUE(eventually([] { return isAt(kFar, 0.01); }));
  expectNoJolt("sought and resumed, with --to-start");
}

// --------------------------------------------------------------------- somebody has moved the arm

TEST_F(ReplayWithoutJolts, isStoppedWhereSomebodyHasMovedTheArmBetweenTwoGoals) {
  const ArmPose further = {0.05, 0.0, 0.4, 0.3, 1.0, 0.4, 1.2, 0.4};
  const std::int64_t behavior = recorded(kArmAction + "/goal", [&] {
    EXPECT_EQ(world->arm->sendGoalAndWait(denseGoal(kTucked, kFar, 2), kPatience),
              State::SUCCEEDED);
    ros::WallDuration(3).sleep();
    EXPECT_EQ(world->arm->sendGoalAndWait(denseGoal(kFar, further, 2), kPatience),
              State::SUCCEEDED);
  });
  play(behavior);
  ASSERT_TRUE(eventually([] { return !witness().succeeded().empty(); }))
      << world->replay->getState().getText();
  const double shoulder = turnArm(-0.8);
  expectRefusal("the arm moved between two goals", shoulder);
}

TEST_F(ReplayWithoutJolts, isStoppedWhereSomebodyHasMovedTheArmInAPause) {
  const std::int64_t behavior = recordedArm(denseGoal(kTucked, kFar, 3));
  pauseHalfWay(behavior, "shoulder_lift_joint", kFar[2]);
  const double shoulder = turnArm(-0.8);
  call<std_srvs::Trigger>("/player_node/resume");  // it may refuse here or stop
  expectRefusal("the arm moved in a pause", shoulder);
}

TEST_F(ReplayWithoutJolts, isRefusedFromInsideAGoalWithTheArmElsewhere) {
  const std::int64_t behavior = recordedArm(denseGoal(kTucked, kFar, 3));
  const double shoulder = turnArm(-2.3);
  play(behavior, 1.5);
  expectRefusal("from inside a goal, the arm elsewhere", shoulder);
}

}  // namespace
}  // namespace afterglow::nodes::replay_without_jolts_ros_test

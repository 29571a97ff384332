#include "nodes/fetch/fake_fetch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "nodes/fetch/fetch_facts.hpp"
#include "tests/support/fetch_poses.hpp"

namespace afterglow::nodes::fake_fetch_test {
namespace {

using namespace std::chrono_literals;
using test::armOverTable;
using Phase = TrajectoryStatus::Phase;

constexpr Nanoseconds kNow = 1000s;
constexpr DriveErrors kNoErrors = {1, 1, 0, 1};

FakeFetch makeFetch(const DriveErrors& errors = kNoErrors, const PlanarPose& start = {}) {
  static const RobotModel model = RobotModel::fromFile("assets/fetch.urdf");
  return FakeFetch(model, {start, errors}, kNow);
}

void run(FakeFetch& fetch, Nanoseconds duration) { fetch.step(fetch.now() + duration); }

/// Commands the base every 50 ms, as people do.
void drive(FakeFetch& fetch, double linear, double angular, Nanoseconds duration) {
  for (const Nanoseconds end = fetch.now() + duration; fetch.now() < end; run(fetch, 50ms))
    fetch.drive(linear, angular);
}

TrajectoryGoal goalTo(const JointPositions& positions, Nanoseconds time) {
  TrajectoryGoal goal;
  goal.points.resize(1);
  for (const auto& [name, position] : positions) {
    goal.joints.push_back(name);
    goal.points[0].positions.push_back(position);
  }
  goal.points[0].time_from_start = time;
  return goal;
}

TEST(DiffDrive, acceleratesAsAFetchDoes) {
  FakeFetch fetch = makeFetch();
  drive(fetch, 0.6, 1.2, 100ms);
  EXPECT_NEAR(fetch.base().linear(), 0.075, 1e-9);
  EXPECT_NEAR(fetch.base().angular(), 0.3, 1e-9);
  drive(fetch, 0.6, 1.2, 1s);
  EXPECT_NEAR(fetch.base().linear(), 0.6, 1e-9);
  EXPECT_NEAR(fetch.base().angular(), 1.2, 1e-9);
}

TEST(DiffDrive, brakesAQuarterSecondAfterTheLastCommand) {
  FakeFetch fetch = makeFetch();
  drive(fetch, 0.3, 0, 1s);  // the last command was 50 ms ago
  run(fetch, 190ms);
  EXPECT_NEAR(fetch.base().linear(), 0.3, 1e-9);
  run(fetch, 10ms);
  EXPECT_LT(fetch.base().linear(), 0.3);
  run(fetch, 400ms);  // 0.3 m/s at 0.75 m/s^2
  EXPECT_EQ(fetch.base().linear(), 0);
}

TEST(DiffDrive, refusesWhatIsNotFiniteAndKeepsToItsLimits) {
  FakeFetch fetch = makeFetch();
  EXPECT_FALSE(fetch.drive(NAN, 0));
  EXPECT_FALSE(fetch.drive(0, INFINITY));
  run(fetch, 1s);
  EXPECT_EQ(fetch.base().truePose().x, 0);
  drive(fetch, 50, 0, 5s);
  EXPECT_EQ(fetch.base().linear(), 1.0);
}

TEST(DiffDrive, drivesArcs) {
  FakeFetch fetch = makeFetch();
  // Both ramps take 0.8 s, so the radius is 0.25 m throughout.
  drive(fetch, 0.6, 2.4, 2s);
  run(fetch, 5s);
  const PlanarPose& pose = fetch.base().truePose();
  EXPECT_NEAR(std::hypot(pose.x, pose.y - 0.25), 0.25, 1e-6);
  EXPECT_NEAR(pose.y, 0.25 * (1 - std::cos(pose.yaw)), 1e-6);
  EXPECT_GT(std::hypot(pose.x, pose.y), 0.1);
}

TEST(DiffDrive, driftsAFewCentimetersAndKnowsHowMuch) {
  FakeFetch fetch = makeFetch(DriveErrors{}, {1, 2, 0.5});
  drive(fetch, 0.5, 0, 6s);
  run(fetch, 2s);
  const PlanarPose truth = fetch.base().truePose();
  const PlanarPose believed = compose({1, 2, 0.5}, fetch.base().odometry());
  const double drift = std::hypot(truth.x - believed.x, truth.y - believed.y);
  EXPECT_GT(drift, 0.005);
  EXPECT_LT(drift, 0.08);
  const PlanarPose localized = compose(fetch.base().mapToOdom(), fetch.base().odometry());
  EXPECT_NEAR(localized.x, truth.x, 1e-9);
  EXPECT_NEAR(localized.y, truth.y, 1e-9);
  EXPECT_NEAR(std::remainder(localized.yaw - truth.yaw, 2 * M_PI), 0, 1e-9);
}

TEST(DiffDrive, driftsTheSameWithTheSameSeed) {
  const auto end = [](std::uint32_t seed) {
    DriveErrors errors;
    errors.seed = seed;
    FakeFetch fetch = makeFetch(errors);
    drive(fetch, 0.4, 0.3, 3s);
    return fetch.base().truePose().x;
  };
  EXPECT_EQ(end(1), end(1));
  EXPECT_NE(end(1), end(2));
}

TEST(DiffDrive, obeysALittleLaterIfItIsToldTo) {
  DriveErrors late = kNoErrors;
  late.latency = 80ms;
  FakeFetch fetch = makeFetch(late);
  fetch.drive(0.6, 0);
  run(fetch, 70ms);
  EXPECT_EQ(fetch.base().linear(), 0);
  run(fetch, 10ms);
  EXPECT_NEAR(fetch.base().linear(), 0.0075, 1e-9);
  drive(fetch, 0.6, 0, 1s);
  run(fetch, 270ms);  // the last command was 50 ms ago and had its effect 80 ms later
  EXPECT_NEAR(fetch.base().linear(), 0.6, 1e-9);
  run(fetch, 10ms);
  EXPECT_LT(fetch.base().linear(), 0.6);
}

TEST(FakeLocalization, isAsFarOffAsItIsToldAndNeighboringErrorsAreAlike) {
  const LocalizationErrors errors{0.03, 0.02, 7, 0, 0};  // it measures all the time
  DiffDrive base({1, 2, 0.5}, kNoErrors);
  FakeLocalization localization(errors, base);
  std::vector<double> x, yaw;
  for (Nanoseconds now = kNow; now < kNow + 1000s; now += 10ms) {
    localization.step(now, base);
    const PlanarPose seen = compose(localization.mapToOdom(), base.odometry());
    if ((now - kNow) % 200ms != 190ms) continue;
    x.push_back(seen.x - 1);
    yaw.push_back(seen.yaw - 0.5);
  }
  const auto product = [](const std::vector<double>& values, std::size_t apart) {
    double sum = 0;
    for (std::size_t i = apart; i < values.size(); ++i) sum += values[i] * values[i - apart];
    return sum / static_cast<double>(values.size() - apart);
  };
  EXPECT_NEAR(std::sqrt(product(x, 0)), 0.03, 0.001);
  EXPECT_NEAR(std::sqrt(product(yaw, 0)), 0.02, 0.001);
  EXPECT_NEAR(product(x, 1) / product(x, 0), std::exp(-1), 0.05);
}

TEST(FakeLocalization, knowsBetterOnlyAfterATenthOfAMeterOrAQuarterOfARadian) {
  DriveErrors errors = kNoErrors;
  errors.linear_scale = 1.05;
  DiffDrive base({}, errors);
  FakeLocalization localization({}, base);
  std::vector<double> renewed;  // where the odometry was
  Nanoseconds now = kNow;
  const auto drive = [&](double linear, double angular, Nanoseconds duration) {
    for (const Nanoseconds end = now + duration; now < end; now += 10ms) {
      base.command(linear, angular, now);
      base.step(now, 10ms);
      const double before = localization.mapToOdom().x;
      localization.step(now, base);
      if (localization.mapToOdom().x != before) renewed.push_back(base.odometry().x);
    }
  };
  drive(0.2, 0, 3s);
  ASSERT_GE(renewed.size(), 3u);
  EXPECT_NEAR(renewed[0], 0.1 + 0.2 * 0.1, 0.01) << "and known 0.1 s later";
  for (std::size_t i = 1; i < renewed.size(); ++i)
    EXPECT_NEAR(renewed[i] - renewed[i - 1], 0.1, 0.01);
  drive(0, 0, 10s);
  const std::size_t at_rest = renewed.size();
  EXPECT_NE(localization.mapToOdom().x, base.mapToOdom().x) << "the last bit is not known";
  drive(0, 0.5, 2s);
  EXPECT_GT(renewed.size(), at_rest);
  EXPECT_NEAR(localization.mapToOdom().x, base.mapToOdom().x, 1e-9);
}

TEST(FakeFetch, takesLongerWithItsArmIfItIsToldTo) {
  FakeFetchConfig config{{}, kNoErrors};
  config.slowness = 1.3;
  FakeFetch fetch(RobotModel::fromFile("assets/fetch.urdf"), config, kNow);
  fetch.follow(kArmWithTorsoController, goalTo(armOverTable(), 4s));
  run(fetch, 5190ms);
  EXPECT_EQ(fetch.controller(kArmWithTorsoController).status().phase, Phase::Running);
  run(fetch, 10ms);
  EXPECT_EQ(fetch.controller(kArmWithTorsoController).status().phase, Phase::Succeeded);
}

TEST(FakeFetch, movesItsArmOverTheTable) {
  FakeFetch fetch = makeFetch();
  fetch.follow(kArmWithTorsoController, goalTo(armOverTable(), 4s));
  run(fetch, 4s);
  EXPECT_EQ(fetch.controller(kArmWithTorsoController).status().phase, Phase::Succeeded);
  for (const auto& [name, position] : armOverTable())
    EXPECT_NEAR(fetch.joints().at(name).position, position, 1e-9) << name;
  EXPECT_NEAR(fetch.joints().at("bellows_joint").position, 0.15, 1e-9);
}

TEST(FakeFetch, leavesJointsToTheControllerThatIsBusyWithThem) {
  FakeFetch fetch = makeFetch();
  fetch.follow(kArmWithTorsoController, goalTo(armOverTable(), 4s));
  run(fetch, 1s);
  JointPositions arm = armOverTable();
  arm.erase("torso_lift_joint");
  for (const auto& [controller, positions] :
       std::map<std::string, JointPositions>{{kTorsoController, {{"torso_lift_joint", 0.05}}},
                                             {kArmController, arm}}) {
    fetch.follow(controller, goalTo(positions, 2s));
    EXPECT_EQ(fetch.controller(controller).status().error, TrajectoryError::GoalToleranceViolated)
        << controller;
  }
  EXPECT_EQ(fetch.controller(kTorsoController).status().text,
            "cannot start: another controller is busy with torso_lift_joint");
  run(fetch, 3s);
  EXPECT_EQ(fetch.controller(kArmWithTorsoController).status().phase, Phase::Succeeded);
}

TEST(FakeFetch, givesJointsThatAreOnlyHeldToAnotherController) {
  FakeFetch fetch = makeFetch();
  fetch.follow(kArmWithTorsoController, goalTo(armOverTable(), 4s));
  run(fetch, 5s);
  fetch.follow(kTorsoController, goalTo({{"torso_lift_joint", 0.05}}, 4s));
  run(fetch, 5s);
  EXPECT_EQ(fetch.controller(kTorsoController).status().phase, Phase::Succeeded);
  EXPECT_NEAR(fetch.joints().at("torso_lift_joint").position, 0.05, 1e-9);
  EXPECT_FALSE(fetch.controller(kArmWithTorsoController).isOn());
}

TEST(FakeFetch, leavesAMovingArmAloneWhenAnotherControllersGoalIsRefused) {
  FakeFetch fetch = makeFetch();
  fetch.follow(kArmWithTorsoController, goalTo(armOverTable(), 4s));
  run(fetch, 1s);
  fetch.follow(kTorsoController, goalTo({{"elbow_flex_joint", 1}}, 2s));
  EXPECT_EQ(fetch.controller(kTorsoController).status().error, TrajectoryError::InvalidJoints);
  run(fetch, 3s);
  EXPECT_EQ(fetch.controller(kArmWithTorsoController).status().phase, Phase::Succeeded);
}

/// As PointHeadController reckons it.
void expectHeadToward(const FakeFetch& fetch, const Eigen::Vector3d& p_base) {
  const auto seenFrom = [&](const char* link) -> Eigen::Vector3d {
    return fetch.model().linkPose(link, fetch.jointPositions()).inverse() * p_base;
  };
  const Eigen::Vector3d torso = seenFrom("torso_lift_link"), pan = seenFrom("head_pan_link");
  EXPECT_NEAR(fetch.joints().at("head_pan_joint").position, std::atan2(torso.y(), torso.x()), 1e-6);
  EXPECT_NEAR(fetch.joints().at("head_tilt_joint").position,
              std::atan2(-pan.z(), std::hypot(pan.x(), pan.y())), 1e-6);
}

TEST(FakeFetch, pointsItsHeadAtAPlace) {
  FakeFetch fetch = makeFetch();
  const Eigen::Vector3d p_base(0.9, 0.3, 0.72);
  fetch.pointHead(p_base, 1s, 0);
  run(fetch, 3s);
  expectHeadToward(fetch, p_base);
  EXPECT_EQ(fetch.controller(kPointHeadController).status().phase, Phase::Succeeded);
  const Eigen::Isometry3d T = fetch.model().linkPose("head_camera_link", fetch.jointPositions());
  EXPECT_LT(T.linear().col(0).cross((p_base - T.translation()).normalized()).norm(), 0.15)
      << "the camera sits beside both axes";
}

TEST(FakeFetch, callsALookSucceededWhenItsTimeIsOverThoughTheHeadCannotTurnThere) {
  FakeFetch fetch = makeFetch();
  fetch.pointHead({-1, 0.1, 1}, 1s, 0);
  run(fetch, 4s);
  EXPECT_EQ(fetch.controller(kPointHeadController).status().phase, Phase::Succeeded);
  EXPECT_NEAR(fetch.joints().at("head_pan_joint").position, 1.57, 1e-9) << "its limit";
}

TEST(FakeFetch, turnsItsHeadForAsLongAsTheAngleTakesOrLongerIfItIsToldTo) {
  for (const auto& [duration, expected_s] :
       std::map<Nanoseconds, double>{{0s, 1.57 / 0.5}, {5s, 5.0}}) {
    FakeFetch fetch = makeFetch();
    fetch.pointHead({-0.087, 5, 1}, duration, 0.5);  // a right angle about torso_lift_link
    const Nanoseconds begin = fetch.now();
    while (fetch.controller(kPointHeadController).isBusy()) run(fetch, 10ms);
    EXPECT_NEAR(seconds(fetch.now() - begin), expected_s, 0.05);
  }
}

TEST(FakeFetch, jumpsToWhatItIsToPointItsHeadAtAfterACancel) {
  FakeFetch fetch = makeFetch();
  const auto stepOf = [&](const Eigen::Vector3d& p_base) {
    fetch.takeCommands();
    fetch.pointHead(p_base, 1s, 0);
    run(fetch, 10ms);
    return fetch.takeCommands().largest_steps.at("head_pan_joint");
  };
  EXPECT_LT(stepOf({1, 1, 1}), 0.01);
  run(fetch, 500ms);
  const double pan = fetch.joints().at("head_pan_joint").position;
  fetch.cancel(kPointHeadController);
  run(fetch, 10s);
  EXPECT_EQ(fetch.joints().at("head_pan_joint").position, pan) << "it holds";
  EXPECT_NEAR(stepOf({1, -1, 1}), pan + std::atan2(1, 1.087), 0.02);
}

TEST(FakeFetch, closesItsGripperAtFiveCentimetersASecondAFinger) {
  FakeFetch fetch = makeFetch();
  fetch.moveGripper(0.08);
  run(fetch, 500ms);
  EXPECT_NEAR(fetch.gripper().gap, 0.05, 1e-6);
  EXPECT_FALSE(fetch.gripper().is_done);
  run(fetch, 300ms);
  EXPECT_NEAR(fetch.gripper().gap, 0.08, 1e-6);
  EXPECT_TRUE(fetch.gripper().is_done);
  EXPECT_TRUE(fetch.gripper().reached);
}

TEST(FakeFetch, callsItsGripperDoneWithinTwoMillimetersOrWhenItHasStalledForTwoSeconds) {
  FakeFetch near = makeFetch();
  near.moveGripper(0.05);
  while (!near.gripper().is_done) run(near, 10ms);
  EXPECT_TRUE(near.gripper().reached);
  EXPECT_GT(std::abs(near.gripper().gap - 0.05), 0.0005) << "on its way still";
  FakeFetch stalled = makeFetch();
  stalled.moveGripper(0.3);  // wider than it can
  run(stalled, 2900ms);
  EXPECT_NEAR(stalled.gripper().gap, 0.1, 1e-6);
  EXPECT_FALSE(stalled.gripper().is_done);
  run(stalled, 200ms);
  EXPECT_TRUE(stalled.gripper().is_done);
  EXPECT_TRUE(stalled.gripper().stalled);
  EXPECT_FALSE(stalled.gripper().reached);
}

// -------------------------------------------------------------------------- somebody moves the arm

JointPositions armMovedBy(const FakeFetch& fetch, double pan) {
  JointPositions arm;
  for (const std::string& joint : kArmJoints) arm[joint] = fetch.joints().at(joint).position;
  arm.at("shoulder_pan_joint") += pan;
  return arm;
}

TEST(FakeFetch, letsItsArmBeMovedByHandWhichAbortsWhatItDid) {
  FakeFetch fetch = makeFetch();
  fetch.follow(kArmWithTorsoController, goalTo(armOverTable(), 4s));
  run(fetch, 1s);
  const JointPositions moved = armMovedBy(fetch, -0.5);
  fetch.moveByHand(moved);
  EXPECT_EQ(fetch.controller(kArmWithTorsoController).status().phase, Phase::Failed);
  run(fetch, 400ms);
  EXPECT_GT(fetch.joints().at("shoulder_pan_joint").position, moved.at("shoulder_pan_joint") + 0.05)
      << "not at once";
  run(fetch, 200ms);
  EXPECT_NEAR(fetch.joints().at("shoulder_pan_joint").position, moved.at("shoulder_pan_joint"),
              1e-9);
  fetch.takeCommands();
  run(fetch, 1s);
  EXPECT_TRUE(fetch.takeCommands().positions.empty()) << "limp";
}

TEST(FakeFetch, stepsAsFarAsItsArmWasMovedBetweenTwoGoals) {
  const auto stepAfter = [](bool is_canceled, Nanoseconds first_point) {
    FakeFetch fetch = makeFetch();
    fetch.follow(kArmController, goalTo(armMovedBy(fetch, -0.2), 2s));
    run(fetch, is_canceled ? 1s : 3s);
    fetch.cancel(kArmController);
    const JointPositions held = armMovedBy(fetch, 0);
    fetch.moveByHand(armMovedBy(fetch, -0.8));
    run(fetch, 1s);
    TrajectoryGoal next = goalTo(held, first_point);
    next.points.push_back(next.points[0]);
    next.points[1].time_from_start += 4s;
    fetch.takeCommands();
    fetch.follow(kArmController, next);
    run(fetch, 100ms);
    return fetch.takeCommands().largest_steps.at("shoulder_pan_joint");
  };
  EXPECT_NEAR(stepAfter(false, 0s), 0.8, 1e-6) << "to the first point";
  EXPECT_NEAR(stepAfter(true, 2s), 0.8, 1e-6) << "to the last command before the cancel";
  EXPECT_LT(stepAfter(false, 2s), 0.005) << "the measured pose is put before it";
}

TEST(FakeFetch, isBackAtItsStartAfterAReset) {
  const PlanarPose start = {1, -1, 0.3};
  FakeFetch fetch = makeFetch(DriveErrors{}, start);
  fetch.follow(kArmWithTorsoController, goalTo(armOverTable(), 4s));
  fetch.moveGripper(0.1);
  drive(fetch, 0.5, 0.5, 2s);
  const PlanarPose drift = fetch.base().mapToOdom();
  fetch.reset();
  run(fetch, 1s);
  EXPECT_NEAR(fetch.base().truePose().x, start.x, 1e-9);
  EXPECT_NEAR(fetch.base().truePose().yaw, start.yaw, 1e-9);
  EXPECT_NEAR(fetch.base().mapToOdom().x, drift.x, 1e-9) << "the drift stays as it was";
  EXPECT_EQ(fetch.controller(kArmWithTorsoController).status().phase, Phase::Stopped);
  EXPECT_NEAR(fetch.joints().at("shoulder_pan_joint").position, 1.32, 1e-9);
  EXPECT_NEAR(fetch.gripper().gap, 0, 1e-9);
}

TEST(FakeFetch, stopsEverythingWhenTheClockIsSetBack) {
  FakeFetch fetch = makeFetch();
  fetch.follow(kArmWithTorsoController, goalTo(armOverTable(), 4s));
  drive(fetch, 0.5, 0, 1s);
  const JointPositions before = fetch.jointPositions();
  fetch.step(kNow - 500s);
  EXPECT_EQ(fetch.controller(kArmWithTorsoController).status().text, "the clock jumped");
  run(fetch, 1s);
  EXPECT_EQ(fetch.jointPositions().at("elbow_flex_joint"), before.at("elbow_flex_joint"));
  EXPECT_EQ(fetch.base().linear(), 0);
}

}  // namespace
}  // namespace afterglow::nodes::fake_fetch_test

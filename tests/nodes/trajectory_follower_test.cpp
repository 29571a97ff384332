#include "nodes/fetch/joint_controller.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace afterglow::nodes::trajectory_follower_test {
namespace {

using namespace std::chrono_literals;
using Phase = TrajectoryStatus::Phase;

constexpr Nanoseconds kNow = 1000s;  ///< when every test begins
constexpr Nanoseconds kStep = 10ms;

/// A shoulder (limits), and a wrist that turns for ever.
class Rig {
 public:
  Rig()
      : follower_({joint("shoulder", Joint::Kind::Revolute, 2),
                   joint("wrist", Joint::Kind::Continuous, 10)}) {}

  static Joint joint(const std::string& name, Joint::Kind kind, double max_velocity) {
    Joint joint;
    joint.name = name;
    joint.kind = kind;
    const bool endless = kind == Joint::Kind::Continuous;
    joint.upper = endless ? std::numeric_limits<double>::infinity() : 1.5;
    joint.lower = -joint.upper;
    joint.max_velocity = max_velocity;
    return joint;
  }

  static TrajectoryGoal goalTo(double shoulder, double wrist, Nanoseconds time) {
    TrajectoryGoal goal;
    goal.joints = {"shoulder", "wrist"};
    goal.points = {{{shoulder, wrist}, {}, {}, time}};
    return goal;
  }

  void start(const TrajectoryGoal& goal) {
    follower_.cancel();
    follower_.start(goal, states_, now_);
    if (follower_.isBusy()) follower_.begin();
  }
  void run(Nanoseconds duration) {
    for (const Nanoseconds end = now_ + duration; now_ < end;) {
      now_ += kStep;
      for (auto& [name, state] : states_) state.velocity = 0;
      const auto commands = follower_.step(states_, now_);
      for (std::size_t i = 0; commands && i < commands->size(); ++i)
        obey(follower_.joints()[i], (*commands)[i]);
      if (commands) command_ = commands->front();
    }
  }
  /// The first command of a goal that is sent now, against the one before it.
  double stepOf(const TrajectoryGoal& goal) {
    const double before = command_;
    start(goal);
    run(kStep);
    return std::abs(command_ - before);
  }
  double shoulder() const { return states_.at("shoulder").position; }
  double wrist() const { return states_.at("wrist").position; }
  const TrajectoryStatus& status() const { return follower_.status(); }

 private:
  void obey(const Joint& joint, double position) {
    JointState& state = states_.at(joint.name);
    const double furthest = joint.max_velocity * seconds(kStep), before = state.position;
    const double way = joint.kind == Joint::Kind::Continuous ? turnBetween(before, position)
                                                             : position - before;
    state.position += std::clamp(way, -furthest, furthest);
    state.position = std::clamp(state.position, joint.lower, joint.upper);
    state.velocity = (state.position - before) / seconds(kStep);
  }

 public:
  TrajectoryFollower follower_;
  double command_ = 0;  ///< the shoulder's latest
  JointStates states_ = {{"shoulder", {}}, {"wrist", {}}};
  Nanoseconds now_ = kNow;
};

TEST(TrajectoryFollower, movesEvenlyBetweenPositions) {
  Rig rig;
  rig.start(Rig::goalTo(1, -0.5, 2s));
  rig.run(500ms);
  EXPECT_NEAR(rig.shoulder(), 0.25, 1e-9);
  EXPECT_NEAR(rig.wrist(), -0.125, 1e-9);
  EXPECT_NEAR(rig.states_.at("shoulder").velocity, 0.5, 1e-9);
  EXPECT_EQ(rig.status().phase, Phase::Running);
  rig.run(1500ms);
  EXPECT_NEAR(rig.shoulder(), 1, 1e-9);
  EXPECT_EQ(rig.status().phase, Phase::Succeeded);
}

TEST(TrajectoryFollower, followsACubicWhereVelocitiesAreGiven) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(1, 0, 2s);
  goal.points[0].velocities = {0, 0};
  rig.start(goal);
  rig.run(500ms);
  EXPECT_NEAR(rig.shoulder(), 3 * 0.0625 - 2 * 0.015625, 1e-9);  // 3 s^2 - 2 s^3 at s = 1/4
  rig.run(500ms);
  EXPECT_NEAR(rig.shoulder(), 0.5, 1e-9);
}

TEST(TrajectoryFollower, followsAQuinticWhereAccelerationsAreGiven) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(1, 0, 2s);
  goal.points[0].velocities = goal.points[0].accelerations = {0, 0};
  rig.start(goal);
  rig.run(500ms);
  const double s = 0.25;
  EXPECT_NEAR(rig.shoulder(), 10 * std::pow(s, 3) - 15 * std::pow(s, 4) + 6 * std::pow(s, 5), 1e-9);
}

TEST(TrajectoryFollower, takesJointsInAnyOrder) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(0, 0, 1s);
  goal.joints = {"wrist", "shoulder"};
  goal.points[0].positions = {0.1, 0.9};
  rig.start(goal);
  rig.run(1s);
  EXPECT_NEAR(rig.shoulder(), 0.9, 1e-9);
  EXPECT_NEAR(rig.wrist(), 0.1, 1e-9);
}

TEST(TrajectoryFollower, refusesOtherJoints) {
  for (const std::vector<std::string>& joints : {std::vector<std::string>{"shoulder"},
                                                 {"shoulder", "elbow"},
                                                 {"shoulder", "wrist", "wrist"}}) {
    Rig rig;
    TrajectoryGoal goal = Rig::goalTo(1, 0, 1s);
    goal.joints = joints;
    goal.points[0].positions.resize(joints.size());
    rig.start(goal);
    EXPECT_EQ(rig.status().phase, Phase::Failed);
    EXPECT_EQ(rig.status().error, TrajectoryError::InvalidJoints);
    EXPECT_EQ(rig.status().text, "joint_names must be this controller's joints: shoulder wrist");
  }
}

TEST(TrajectoryFollower, refusesPointsThatMakeNoSense) {
  const auto refusal = [](const TrajectoryGoal& goal) {
    Rig rig;
    rig.start(goal);
    EXPECT_EQ(rig.status().error, TrajectoryError::InvalidGoal);
    rig.run(1s);
    EXPECT_EQ(rig.shoulder(), 0);
    return rig.status().text;
  };
  EXPECT_EQ(refusal(Rig::goalTo(NAN, 0, 1s)), "points[0] is not finite");
  TrajectoryGoal goal = Rig::goalTo(1, 0, 1s);
  goal.points.push_back(goal.points[0]);
  goal.points[1].time_from_start = 900ms;
  EXPECT_EQ(refusal(goal), "points[1] is before the one before it");
  goal.points[1].time_from_start = 2s;
  goal.points[1].positions.pop_back();
  EXPECT_EQ(refusal(goal), "points[1] does not have a value for each joint");
}

// ------------------------------------------------- where a goal begins: executeCb() and its stamps

TEST(TrajectoryFollower, doesNotRefuseAStampInThePastButJumpsToWhereTheTrajectoryStandsNow) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(-0.4, 0, 1s);
  goal.points.push_back({{1, 0}, {}, {}, 3s});
  goal.stamp = kNow - 2s;  // half-way between its points
  EXPECT_NEAR(rig.stepOf(goal), 0.3, 0.01);
  Rig late;
  goal.stamp = kNow - 3600s;
  EXPECT_NEAR(late.stepOf(goal), 1, 1e-9);
  EXPECT_EQ(late.status().error, TrajectoryError::GoalToleranceViolated) << "an hour late";
  late.run(600ms);
  EXPECT_NEAR(late.shoulder(), 1, 1e-9) << "it goes there all the same";
}

TEST(TrajectoryFollower, movesAtOnceTowardAStartInTheFuture) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(1, 0, 1s);
  goal.stamp = kNow + 1s;
  rig.start(goal);
  rig.run(1s);
  EXPECT_NEAR(rig.shoulder(), 0.5, 1e-9);
}

TEST(TrajectoryFollower, stepsToAPointAtTheStartAndPutsTheMeasuredPoseBeforeALaterOne) {
  TrajectoryGoal goal = Rig::goalTo(1, 0, 0s);
  goal.points.push_back({{1.1, 0}, {}, {}, 2s});
  Rig rig;
  EXPECT_NEAR(rig.stepOf(goal), 1, 0.01);
  EXPECT_NEAR(rig.shoulder(), 0.02, 1e-9) << "as fast as the joint can";
  goal.points[0].time_from_start = 1s;
  Rig patient;
  EXPECT_NEAR(patient.stepOf(goal), 0.01, 1e-9);
  Rig single;
  EXPECT_NEAR(single.stepOf(Rig::goalTo(1, 0, 1s)), 0.01, 1e-9);
}

TEST(TrajectoryFollower, beginsAGoalAfterASuccessWhereTheJointsAreBeItFarFromTheLastCommand) {
  Rig rig;
  rig.start(Rig::goalTo(0.5, 0, 1s));
  rig.run(1100ms);
  ASSERT_EQ(rig.status().phase, Phase::Succeeded);
  rig.follower_.letGo("switched off");
  rig.states_["shoulder"].position = -0.3;  // by hand
  rig.start(Rig::goalTo(0.7, 0, 1s));
  rig.run(kStep);
  EXPECT_NEAR(rig.command_, -0.29, 1e-9);
}

// --------------------------------------------- a cancel, and the goal after it (their issue 33)

TEST(TrajectoryFollower, holdsItsLastCommandAtOnceWhenCanceled) {
  Rig rig;
  rig.start(Rig::goalTo(1.4, 0, 2s));
  rig.run(1s);
  rig.follower_.cancel();
  EXPECT_EQ(rig.status().phase, Phase::Stopped);
  EXPECT_EQ(rig.status().text, "canceled");
  rig.run(5s);
  EXPECT_NEAR(rig.shoulder(), 0.7, 1e-9);
  EXPECT_TRUE(rig.follower_.isOn()) << "it holds";
}

TEST(TrajectoryFollower, makesGoodInOneStepWhatPassedSinceACancelBeforeTheNextGoal) {
  Rig rig;
  rig.start(Rig::goalTo(1.4, 0, 2s));
  rig.run(1s);
  rig.follower_.cancel();
  rig.run(3s);
  // From 0.7 rad three seconds ago to 0 in one second from now: three quarters of it are over.
  EXPECT_NEAR(rig.stepOf(Rig::goalTo(0, 0, 1s)), 0.7 * 0.75, 0.01);
}

TEST(TrajectoryFollower, beginsAGoalAfterACancelAtItsLastCommandWhereverTheJointsAreByNow) {
  Rig rig;
  rig.start(Rig::goalTo(1.4, 0, 2s));
  rig.run(1s);
  rig.follower_.cancel();
  rig.run(kStep);
  rig.follower_.letGo("switched off");
  rig.states_["shoulder"].position = -0.1;  // by hand
  rig.start(Rig::goalTo(0, 0, 10s));
  rig.run(kStep);
  EXPECT_NEAR(rig.command_, 0.7, 0.01);
}

TEST(TrajectoryFollower, doesNotStepAfterACancelIfTheGoalBeginsWhereTheJointsAreNow) {
  Rig rig;
  rig.start(Rig::goalTo(1.4, 0, 2s));
  rig.run(1s);
  rig.follower_.cancel();
  rig.run(10s);
  TrajectoryGoal goal = Rig::goalTo(0.7, 0, 0s);
  goal.points.push_back({{0, 0}, {}, {}, 1s});
  EXPECT_LT(rig.stepOf(goal), 0.011);
}

TEST(TrajectoryFollower, forgetsACancelWithTheNextGoalThatItBegins) {
  Rig rig;
  rig.start(Rig::goalTo(1.4, 0, 2s));
  rig.run(1s);
  rig.follower_.cancel();
  rig.start(Rig::goalTo(0.7, 0, 1s));
  rig.run(1100ms);
  ASSERT_EQ(rig.status().phase, Phase::Succeeded);
  rig.run(10s);
  EXPECT_LT(rig.stepOf(Rig::goalTo(0, 0, 1s)), 0.01);
}

TEST(TrajectoryFollower, goesOnFromItsLastCommandWithANewGoal) {
  Rig rig;
  rig.start(Rig::goalTo(1.4, 0, 2s));
  rig.run(1s);
  EXPECT_NEAR(rig.stepOf(Rig::goalTo(0, 0, 1s)), 0.007, 1e-4);
  rig.run(1s);
  EXPECT_NEAR(rig.shoulder(), 0, 1e-9);
}

TEST(TrajectoryFollower, letsGoWhereATrajectoryHasNoPoints) {
  Rig rig;
  rig.start(Rig::goalTo(1.4, 0, 2s));
  rig.run(1s);
  rig.start(TrajectoryGoal());
  EXPECT_EQ(rig.status().phase, Phase::Failed);
  EXPECT_FALSE(rig.follower_.isOn()) << "limp";
  rig.run(1s);
  EXPECT_NEAR(rig.shoulder(), 0.7, 1e-9);
}

TEST(TrajectoryFollower, turnsAContinuousJointTheShortWay) {
  Rig rig;
  rig.states_["wrist"].position = 6.2;
  rig.start(Rig::goalTo(0, 0.1, 1s));
  rig.run(1s);
  EXPECT_NEAR(rig.wrist(), 0.1 + 2 * 3.14159265358979, 1e-6);
}

TEST(TrajectoryFollower, holdsThePoseOfAGoalThatIsOver) {
  Rig rig;
  rig.start(Rig::goalTo(0.5, 0, 1s));
  rig.run(2s);
  rig.states_["shoulder"].position = 0.3;  // pushed
  rig.run(1s);
  EXPECT_NEAR(rig.shoulder(), 0.5, 1e-9);
}

TEST(TrajectoryFollower, failsAGoalItCannotReachInTime) {
  Rig rig;
  rig.start(Rig::goalTo(2, 0, 1s));  // the limit is 1.5
  rig.run(1500ms);
  EXPECT_EQ(rig.status().phase, Phase::Running);  // 0.6 s of patience
  rig.run(200ms);
  EXPECT_EQ(rig.status().error, TrajectoryError::GoalToleranceViolated);
  EXPECT_EQ(rig.status().text, "shoulder did not reach its goal");
  EXPECT_NEAR(rig.shoulder(), 1.5, 1e-9);
}

TEST(TrajectoryFollower, takesTolerancesOnlyOfEveryJoint) {
  Rig some;
  TrajectoryGoal goal = Rig::goalTo(2, 0, 1s);
  goal.goal_tolerance = {{"shoulder", 0}};
  some.start(goal);
  some.run(1700ms);
  EXPECT_EQ(some.status().error, TrajectoryError::GoalToleranceViolated) << "the controller's own";
  Rig all;
  goal.goal_tolerance = {{"wrist", 0.1}, {"shoulder", 0}};
  all.start(goal);
  all.run(1s);
  EXPECT_EQ(all.status().phase, Phase::Succeeded) << "0 lifts it";
  Rig others;
  goal.goal_tolerance = {{"wrist", 0.1}, {"tail", 0.1}};
  others.start(goal);
  EXPECT_EQ(others.status().error, TrajectoryError::InvalidJoints);
  EXPECT_EQ(others.status().text, "there is no tolerance of shoulder");
}

TEST(TrajectoryFollower, failsWhereAJointLeavesItsPathAndPushesOn) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(1.4, 0, 100ms);  // 14 rad/s of a joint that can do 2
  goal.path_tolerance = {{"shoulder", 0.3}, {"wrist", 0}};
  rig.start(goal);
  rig.run(100ms);
  EXPECT_EQ(rig.status().error, TrajectoryError::PathToleranceViolated);
  EXPECT_EQ(rig.status().text, "shoulder left its path");
  EXPECT_LT(rig.shoulder(), rig.command_);
  rig.run(1s);
  EXPECT_NEAR(rig.shoulder(), rig.command_, 1e-9) << "to what was commanded last";
}

}  // namespace
}  // namespace afterglow::nodes::trajectory_follower_test

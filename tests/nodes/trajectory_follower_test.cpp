#include "nodes/fetch/trajectory_follower.hpp"

#include <gtest/gtest.h>

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

  void start(const TrajectoryGoal& goal) { follower_.start(goal, states_, now_); }
  void run(Nanoseconds duration) {
    for (const Nanoseconds end = now_ + duration; now_ < end;) {
      now_ += kStep;
      follower_.step(states_, now_, kStep);
    }
  }
  double shoulder() const { return states_.at("shoulder").position; }
  double wrist() const { return states_.at("wrist").position; }
  const TrajectoryStatus& status() const { return follower_.status(); }

  TrajectoryFollower follower_;
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
  EXPECT_EQ(refusal(goal), "points[1] is not after the one before");
  goal.points[1].time_from_start = 2s;
  goal.points[1].positions.pop_back();
  EXPECT_EQ(refusal(goal), "points[1] does not have a value for each joint");
}

TEST(TrajectoryFollower, refusesATrajectoryThatIsAllInThePast) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(1, 0, 2s);
  goal.stamp = kNow - 3600s;
  rig.start(goal);
  rig.run(1s);
  EXPECT_EQ(rig.status().error, TrajectoryError::OldHeaderTimestamp);
  EXPECT_EQ(rig.shoulder(), 0);
}

TEST(TrajectoryFollower, dropsThePointsThatAreInThePast) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(-0.4, 0, 1s);
  goal.points.push_back({{1, 0}, {}, {}, 3s});
  goal.stamp = kNow - 2s;  // the first point was due a second ago, the last is due in one
  rig.start(goal);
  rig.run(500ms);
  EXPECT_NEAR(rig.shoulder(), 0.5, 1e-9);
  rig.run(500ms);
  EXPECT_NEAR(rig.shoulder(), 1, 1e-9);
}

TEST(TrajectoryFollower, waitsForAStartInTheFuture) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(1, 0, 1s);
  goal.stamp = kNow + 1s;
  rig.start(goal);
  rig.run(990ms);
  EXPECT_EQ(rig.shoulder(), 0);
  rig.run(510ms);
  EXPECT_NEAR(rig.shoulder(), 0.5, 1e-9);
}

TEST(TrajectoryFollower, jumpsAsFastAsTheJointCanToAPointAtTheStart) {
  Rig rig;
  rig.start(Rig::goalTo(1, 0, 0s));
  rig.run(100ms);
  EXPECT_NEAR(rig.shoulder(), 0.2, 1e-9);  // 2 rad/s
  rig.run(400ms);
  EXPECT_EQ(rig.status().phase, Phase::Succeeded);
}

TEST(TrajectoryFollower, stopsWhereATrajectoryHasNoPoints) {
  Rig rig;
  rig.start(Rig::goalTo(1.4, 0, 2s));
  rig.run(1s);
  TrajectoryGoal stop;
  rig.start(stop);
  EXPECT_EQ(rig.status().phase, Phase::Succeeded);
  rig.run(2s);
  EXPECT_NEAR(rig.shoulder(), 0.77, 1e-6);  // 0.7 m/s for 1 s, then 0.1 s' worth of braking
}

TEST(TrajectoryFollower, goesOnFromFullFlightWithANewGoal) {
  Rig rig;
  rig.start(Rig::goalTo(1.4, 0, 2s));
  rig.run(1s);
  TrajectoryGoal next = Rig::goalTo(0, 0, 1s);
  next.points[0].velocities = {0, 0};
  rig.start(next);
  double previous = rig.shoulder(), velocity = 0.7;
  for (int i = 0; i < 100; ++i) {
    rig.run(kStep);
    const double now = (rig.shoulder() - previous) / 0.01;
    EXPECT_LT(std::abs(now - velocity), 0.12);  // no jerk: at most 12 rad/s^2
    previous = rig.shoulder(), velocity = now;
  }
  EXPECT_NEAR(rig.shoulder(), 0, 1e-9);
}

TEST(TrajectoryFollower, brakesWhenStopped) {
  Rig rig;
  rig.start(Rig::goalTo(1.4, 0, 2s));
  rig.run(1s);
  rig.follower_.stop(rig.states_, rig.now_, "canceled");
  EXPECT_EQ(rig.status().phase, Phase::Stopped);
  EXPECT_EQ(rig.status().text, "canceled");
  rig.run(100ms);
  EXPECT_LT(rig.states_.at("shoulder").velocity, 0.7);
  EXPECT_GT(rig.states_.at("shoulder").velocity, 0.1);
  rig.run(1s);
  EXPECT_EQ(rig.states_.at("shoulder").velocity, 0);
}

TEST(TrajectoryFollower, turnsAContinuousJointTheShortWay) {
  Rig rig;
  rig.states_["wrist"].position = 6.2;
  rig.start(Rig::goalTo(0, 0.1, 1s));
  rig.run(1s);
  EXPECT_NEAR(rig.wrist(), 0.1 + 2 * 3.14159265358979, 1e-6);
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

TEST(TrajectoryFollower, acceptsAnyEndWhereTheToleranceIsLifted) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(2, 0, 1s);
  goal.goal_tolerance = {{"shoulder", -1}};
  rig.start(goal);
  rig.run(1s);
  EXPECT_EQ(rig.status().phase, Phase::Succeeded);
}

TEST(TrajectoryFollower, failsWhereAJointLeavesItsPath) {
  Rig rig;
  TrajectoryGoal goal = Rig::goalTo(1.4, 0, 100ms);  // 14 rad/s of a joint that can do 2
  goal.path_tolerance = {{"shoulder", 0.3}};
  rig.start(goal);
  rig.run(1s);
  EXPECT_EQ(rig.status().error, TrajectoryError::PathToleranceViolated);
  EXPECT_LT(rig.shoulder(), 0.2);  // and holds there
}

}  // namespace
}  // namespace afterglow::nodes::trajectory_follower_test

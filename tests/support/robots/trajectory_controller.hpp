/// \file
/// Controllers of joint trajectories as robots beside the Fetch have them, simulated: what a goal,
/// a command, a cancel and time do to their joints. As impolite as they are:
/// - ros_controllers (joint_trajectory_controller, noetic-devel): points that lie in the past are
///   dropped, a goal of nothing else is refused; the rest is joined to the present *desired* state
///   by a spline. A cancel holds the *measured* pose at once, or ramps in stop_trajectory_duration.
/// - pr2_controllers (joint_trajectory_action_controller): joined 10 ms ahead; a first point at 0
///   is a step, and a stamp in the past a jump to where the trajectory stands by now.
/// Both abort a goal that leaves its path, and follow its trajectory on. Nanoseconds of robot time.
#pragma once

#include <string>
#include <vector>

#include "nodes/fetch/joint_controller.hpp"
#include "tests/support/robots/robot_facts.hpp"

namespace afterglow::test {

/// Not thread safe.
class TrajectoryController {
 public:
  static constexpr nodes::Nanoseconds kCycle{10'000'000};

  /// It holds the joints where they are.
  TrajectoryController(const ControllerFacts& facts, std::vector<nodes::Joint> joints,
                       const nodes::JointStates& measured);

  const std::vector<nodes::Joint>& joints() const { return joints_; }

  enum class Answer { Accepted, OtherJoints, Invalid };
  /// A goal or a command with points. One that is not accepted changes nothing.
  Answer follow(const nodes::TrajectoryGoal& goal, nodes::Nanoseconds now);
  /// A cancel, or a trajectory without points.
  void hold(const nodes::JointStates& measured);
  /// As when it is started.
  void begin(const nodes::JointStates& measured);

  enum class Event { None, Reached, LeftPath, MissedGoal };
  /// A cycle, in which its time goes on by `scale` of one. What has become of the latest goal; to
  /// be told once it is over.
  Event step(const nodes::JointStates& measured, double scale);
  /// What it commands in this cycle, in the order of joints().
  const std::vector<double>& desired() const { return desired_.positions; }

 private:
  nodes::JointKnot at(nodes::Nanoseconds time) const;
  nodes::JointKnot measuredKnot(const nodes::JointStates& measured) const;
  void stand(nodes::JointKnot knot);
  bool isMissing(const nodes::JointStates& measured, double tolerance) const;

  const ControllerFacts facts_;
  const std::vector<nodes::Joint> joints_;
  nodes::Nanoseconds time_{0};  ///< since it was made, as fast as it is scaled
  nodes::JointPath before_, path_;  ///< from begin_ on the latter
  nodes::Nanoseconds begin_{0}, end_{0};
  nodes::JointKnot desired_;
  double goal_tolerance_ = 0, path_tolerance_ = 0, goal_time_ = 0;
};

}  // namespace afterglow::test

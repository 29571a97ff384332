/// \file
/// The stance of the robot when a behavior began and ended, as far as its replay moves that: joint
/// trajectories are absolute, and a drive leads elsewhere from elsewhere. Meters and radians.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "replay/motion/base/track_reader.hpp"
#include "replay/motion/planar_pose.hpp"
#include "replay/motion/robot_joints.hpp"
#include "replay/plan/play_plan.hpp"

namespace afterglow::replay {

/// control_msgs/GripperCommandActionGoal
bool isGripperGoal(const Channel& channel);

/// A topic of goals for joints, with the first of them.
struct JointGoals {
  Channel output;  ///< channel as it is published
  Bytes first;
  std::vector<std::string> joints;  ///< joints of any of them; empty: a gripper's
};

/// The parts that a replay moves.
struct MovedParts {
  std::vector<JointGoals> goals;
  /// Topics of set points that do not say what they move: it cannot be compared with how it stood.
  std::vector<std::string> unnamed;
  bool moves_base = false, moves_joints = false;
  RobotJoints robot{};

  bool movesGripper() const;
  /// Returns their names; those of the gripper are not named.
  std::vector<std::string> joints() const;
};
/// Reads the goals and joint trajectories of the played topics, also those before the part that is
/// played: a motion under way at its begin goes on in it. Throws StoreError; messages that cannot
/// be understood are left out.
MovedParts movedParts(const Store& store, const PlayPlan& plan, const RobotJoints& robot = {});

struct StartPose {
  std::map<std::string, double> joints;
  std::optional<PlanarPose> base;  ///< pose on the map
  RobotJoints robot{};             ///< joints of the robot, as the moved parts have them
  /// Error of `base`, as a share of a single measurement of the localization: standing for long
  /// makes it small, unless localization looks again only after motion.
  PoseError base_share = {1, 1};
};

/// Reads what was recorded of the moved parts at the begin of what is played: the last position
/// until then, else the first within a second after it, on topics of sensor_msgs/JointState; of the
/// base, also where joints alone are moved, by tf. `remarks` says what is not known, a sentence
/// each. Throws StoreError.
StartPose readStartPose(const Store& store, const PlayPlan& plan, const MovedParts& parts,
                        std::vector<std::string>& remarks, const TrackFrames& frames = {});

/// The same at the end of what is played: of the joints at `at`, which may be later, when the last
/// goal had been reached.
StartPose readEndPose(const Store& store, const PlayPlan& plan, const MovedParts& parts, Stamp at,
                      std::vector<std::string>& remarks, const TrackFrames& frames = {});

struct StartTolerances {
  double turning = 0.05, sliding = 0.02, gripper = 0.01;  ///< tolerances of joints
  double base = 0.05, base_turn = 3 / kDegreesPerRadian;
};

double toleranceOf(const RobotJoints& robot, const std::string& joint,
                   const StartTolerances& tolerances);
/// "elbow_flex_joint is 0.42 rad off (now 0.10, then 0.52)"
std::string deviationText(const RobotJoints& robot, const std::string& joint, double off,
                          double then, double now);

/// Returns all deviations of `now` from `then`, a clause each, the farthest first. What `now` lacks
/// is one. Joints that only follow others are not looked at.
std::vector<std::string> jointDeviations(const StartPose& then, const StartPose& now,
                                         const StartTolerances& tolerances);
/// Returns the deviation of the base, with where it was as seen from where it is; empty if there is
/// none.
std::string baseDeviation(const StartPose& then, const StartPose& now,
                          const StartTolerances& tolerances);
/// The same for a replay that moves joints alone, of a base that is looked at once: a
/// localization's noise is allowed for. With the way to allow it.
std::string baseDeviationAtALook(const StartPose& then, const StartPose& now,
                                 const StartTolerances& tolerances);
/// Returns why a replay may not begin as the robot stands: how far it is off, the farthest joints
/// alone, and what helps. `base`: baseDeviation(), with what was tried; `goes_there`: --to-start
/// was said. Empty if there is no deviation.
std::string whyElsewhere(const std::vector<std::string>& joints, const std::string& base,
                         bool goes_there);
/// The tolerances for a base of which localization knows no more than that, two standard
/// deviations; at most 0.1 m and 0.1 rad wider.
StartTolerances widened(StartTolerances tolerances, const PoseError& doubt);

/// The greatest speed of joints on the way to the start.
struct ApproachSpeed {
  double turning = 0.3, sliding = 0.05;  ///< rad/s, m/s
  /// Returns the speed of one joint: no faster than the robot's description allows.
  double of(const RobotJoints& robot, const std::string& joint) const;
};

}  // namespace afterglow::replay

/// \file
/// The body gate: the conditions of a replay that moves the robot. Its controllers run, the
/// emergency stop is released, the robot stands where the behavior began, and a watchdog runs
/// beside the player.
#pragma once

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "nodes/player/guarded_sink.hpp"
#include "nodes/player/replayed_base.hpp"
#include "nodes/player/robot_description.hpp"
#include "nodes/player/stop_inputs.hpp"
#include "nodes/player/take_over.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/motion/arm/approach.hpp"
#include "replay/motion/arm/start_pose.hpp"
#include "replay/plan/robot_profile.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// ROS parameters of the same meaning are named in brackets.
struct BodyOptions {
  /// The place where the robot may stand when it begins [~to_start, ~any_start].
  enum class Start { AsRecorded, MoveThere, Anywhere } start = Start::AsRecorded;
  replay::StartTolerances tolerances;  ///< [~start_tolerance/turning, .../sliding, ...]
  replay::ApproachSpeed speed;
  /// Joints may go far to the start on a way that nobody has checked [~unchecked_approach].
  bool accepts_unchecked = false;
  /// The time that the player may hang in motion before the watchdog stops the robot
  /// [~longest_stall]; empty: by how late this machine is (replay/motion/stops/patience.hpp).
  std::optional<double> longest_stall_s;
  StopOptions stops;
  BaseOptions base;
  bool is_any_map_right = false;  ///< another map than the recorded one will do [~any_map]
  replay::RobotProfile robot;     ///< [~robot]
  replay::RobotJoints joints;     ///< joints by the robot's description
  replay::MotionLimits limits;  ///< [~limits], bounded by the description and the profile
  std::vector<std::string> joint_topics = {"/joint_states"};
};

/// The body's outputs that nobody obeys: "nobody listens on /cmd_vel", "there is no action server
/// /arm/follow_joint_trajectory", "arm_controller is stopped". Asks the robot's controller managers.
std::vector<std::string> missingControllers(const replay::PlayPlan& plan,
                                            const replay::RobotProfile& robot,
                                            const RosGraph& graph);
/// Returns true if the base is moved, be it to the start alone.
bool movesBase(const replay::PlayPlan& plan, const replay::MovedParts& parts);
/// Returns why a replay may not begin whose messages do not tell what they move; empty: it may.
std::string whyUnnamed(const replay::MovedParts& parts, const BodyOptions& options);
/// Returns the stance of the moved parts at the start, as far as it is compared: nothing where they
/// may start anywhere, and not the base where it follows its odometry alone. `base`: none if it is
/// not moved.
replay::StartPose startToCompare(const replay::Store& store, const replay::PlayPlan& plan,
                                 const BodyOptions& options, const replay::MovedParts& parts,
                                 const ReplayedBase* base, std::vector<std::string>& remarks);
/// Returns the stance now of the parts that are moved, or that are known of `then`; waits at most 3
/// s for them, or until `is_stopped`; with all others that are known by then. `frames`: today's.
replay::StartPose askStart(const BodyOptions& options, const replay::MovedParts& parts,
                           const replay::StartPose& then, const replay::TrackFrames& frames,
                           const std::function<bool()>& is_stopped);
/// Returns which joints that are moved the robot lacks; empty: none.
std::string whyNoJoints(const BodyOptions& options, const replay::MovedParts& parts,
                        const replay::StartPose& now);
/// Reads the ways that were recorded of joints and base until two minutes before what is played.
replay::Approach readApproach(const replay::Store& store, const replay::PlayPlan& plan,
                              const BodyOptions& options);

/// Guards the body of one replay. Everything given must outlive it.
class BodyGate {
 public:
  /// Starts the watchdog. `stop` stops the replay, `halt` has it stand until it is called with
  /// false; any thread. Throws std::runtime_error, one line.
  BodyGate(const replay::Store& store, const replay::PlayPlan& plan, const BodyOptions& options,
           replay::MessageSink& sink, replay::Clock& clock,
           std::function<void(const std::string& reason)> stop,
           std::function<void(bool halts)> halt);

  ~BodyGate() { sink_.watchGap(nullptr); }
  BodyGate(const BodyGate&) = delete;
  BodyGate& operator=(const BodyGate&) = delete;

  /// Everything is advertised and connected. Moves the robot to the start if that is asked for.
  /// Throws std::runtime_error, one line, if the replay may not begin.
  void check(const std::function<bool()>& is_stopped);

  /// The sink that the player publishes on, and the clock that it sleeps on; after check().
  replay::MessageSink& sink();
  replay::Clock& clock() { return sink_.clock(); }
  /// The base's drive, after check(); nullptr: velocities are sent as they were recorded.
  replay::BaseDrive* baseDrive() { return base_ ? base_->drive() : nullptr; }
  /// The arm's start, after check(); nullptr: no joints are moved.
  replay::ArmStart* armStart() { return arm_ ? &*arm_ : nullptr; }
  /// PlayOptions::gaze_frame
  std::string gazeFrame() const;
  /// Returns what the base waits for now: a clause; empty while it does not. Any thread.
  std::string waitsFor() const;
  /// PlayOptions::goals
  replay::GoalBook& goals() { return sink_.goals(); }
  /// Hears the status of a goal after the player, which takes the goal's end from the book. Any
  /// thread.
  void onGoalStatus(const std::string& id, const replay::GoalEnd& end);
  /// The robot was moved. Any thread.
  bool hasMoved() const { return sink_.hasMoved(); }
  /// Returns the positions of the robot's joints, as far as they are told of; empty if none are
  /// moved.
  std::map<std::string, double> joints() const;
  /// Adds what could not be checked, where the robot was moved, how the base was, and who watched.
  void addTo(replay::PlayReport& report) const;

 private:
  replay::StartPose live(const replay::StartPose& then,
                         const std::function<bool()>& is_stopped) const;
  std::string baseDeviation(const replay::StartPose& then, const replay::StartPose& now,
                            const std::function<bool()>& is_stopped);
  std::string goToStart(const replay::StartPose& then, replay::StartPose now,
                        const std::function<bool()>& is_stopped);
  void checkWays(const replay::StartPose& then, const replay::StartPose& now) const;
  std::optional<replay::StartGoal> goalToStart(const replay::JointGoals& goals,
                                               const replay::StartPose& then,
                                               const replay::StartPose& now,
                                               const std::string& id,
                                               const replay::PoseCheck& check) const;
  void moveToStart(const replay::StartPose& then, const std::function<bool()>& is_stopped);
  void waitForGuards(const std::function<bool()>& is_stopped);
  void listenToJoints(const std::function<bool()>& is_stopped);
  std::vector<std::string> movingJoints();
  void lookAhead(const std::function<bool()>& is_stopped);
  void watchArm();
  void watchGripper();
  void holdGaze(const std::function<bool()>& is_stopped);

  const replay::Store& store_;
  const replay::PlayPlan& plan_;
  const BodyOptions options_;
  const std::function<void(const std::string&)> stop_;
  replay::MovedParts parts_;
  TakeOver take_over_;
  GuardedSink sink_;
  MasterMonitor master_watch_;
  std::optional<replay::PlayGuards> guards_;
  std::optional<StopInputs> stops_;
  std::optional<ReplayedBase> base_;
  std::string why_no_drive_;  ///< reason if the base may not drive to the start
  std::optional<OpenLoopMonitor>
      open_loop_;  ///< if recorded velocities are sent, and a scan is seen
  mutable std::mutex waits_mutex_;
  std::string waits_for_;
  std::optional<LiveJoints> joints_;  ///< if there are goals
  std::optional<replay::Approach> approach_;  ///< likewise
  std::optional<replay::ArmStart> arm_;
  std::vector<std::string> notes_;
};

}  // namespace afterglow::nodes

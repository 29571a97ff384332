/// \file
/// A replay into the running robot, from its plan to the report: the common part of player_node and
/// `afterglow play`.
///
/// The stance of the robot when a replay is over, against how it stood when that was recorded.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/player/body_gate.hpp"
#include "nodes/player/rehearsal.hpp"
#include "nodes/player/replay_request.hpp"
#include "nodes/player/ros_sink.hpp"
#include "nodes/player/world_anchor.hpp"
#include "replay/motion/arm/start_pose.hpp"
#include "replay/play/play_report.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Any thread may command it and ask for its progress; run() is called once.
class ReplaySession {
 public:
  /// Finds and plans; needs no master. Throws as planReplay(), and for motion above the limits.
  ReplaySession(const replay::Store& store, const ReplayRequest& request);

  const replay::PlayPlan& plan() const { return plan_; }
  /// The fastest that it moves, at rate 1.
  std::vector<replay::MotionPeak> peaks() const;
  /// Throws std::runtime_error, one line, if the replay would move the robot and may not, or in a
  /// way that nothing stops, or publishes nothing.
  void checkPlayable() const;
  /// Finds what run() would be refused for, as far as it can be known: moves, advertises and
  /// publishes nothing. With a master ROS has been started. Throws StoreError.
  Rehearsal rehearse(bool has_master, const std::function<bool()>& is_stopped);

  /// Plays and cleans up. Throws std::runtime_error, before anything is advertised, if it would
  /// move the robot and may not or has nothing to play, if base or light were recorded on another
  /// map, if no master answers within 2 s, if another node publishes the same (live_graph.hpp), or
  /// if it should give /clock and another node does; before anything is sent, for topics that
  /// nobody hears, if that is asked for, and for what BodyGate refuses. Stops, before or while it
  /// plays, when another node sends velocities on a topic that is played.
  replay::PlayReport run();

  void stop(const std::string& reason);
  /// False: goes on.
  void pause(bool pauses = true);
  bool isPaused() const;
  // These throw std::runtime_error, one line, for what is not possible, also before it plays.
  void setRate(double rate);
  /// Returns what `command` does with the player that plays.
  template <typename Command>
  auto tell(const Command& command) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!player_) throw std::runtime_error("it does not play yet");
    return command(*player_);
  }
  replay::PlayProgress progress() const;
  /// The robot may be on its way to where the behavior began: before it plays.
  bool goesToStart() const;
  /// Returns what the base waits for now: a clause; empty while it does not.
  std::string waitsFor() const;

 private:
  /// Closes the gate in any case.
  struct GateKeeper {
    ReplaySession& session;
    ~GateKeeper() { session.closeGate(); }
  };

  void refuseOtherMap() const;
  replay::PlayReport play(RosSink& sink);
  void openGate(RosSink& sink, replay::Clock& clock, const std::function<void()>& on_threads_begun);
  void reportOnceMoved(const std::function<void()>& prepare);
  void closeGate();
  void waitBeforeStart();
  std::optional<replay::Stamp> position() const;
  std::optional<AnchorBroadcast::Moment> moment() const;
  void passGate(double rate);
  void checkRate(double rate) const;
  RateControl::Replay asSeenByConsumer();
  bool isStopped() const;

  const replay::Store& store_;
  ReplayRequest request_;
  const replay::PlayPlan plan_;
  mutable std::mutex mutex_;
  std::vector<replay::MotionPeak> peaks_;   ///< peaks by the limits as they are known
  std::unique_ptr<BodyGate> gate_;          ///< set while run() plays what moves the robot
  std::unique_ptr<replay::Player> player_;  ///< set while run() plays
  std::optional<replay::PlayProgress> ended_;  ///< where it played until, once it has: idle
  std::optional<std::string> stop_reason_;
  bool is_paused_ = false;
  bool is_halted_ = false;  ///< nobody holds the button that lets it move
  std::unique_ptr<ReplayTime> time_;  ///< last: tells of its clock until its end
};

/// The errors at the end. Joints that `now` lacks become a remark.
replay::BodyEnd compareEnds(const replay::StartPose& then, const replay::StartPose& now);

/// Reads what was recorded at the end of what was played, or when its last goal had been reached,
/// and asks the robot (/joint_states; tf, unless a drive has found where the base ended). Takes 3 s
/// if nobody answers, at most until `is_stopped`; joints that nobody tells of by then are where
/// they were heard of last, in `joints`. Adds the errors to the report, or why they are not known.
void addEnd(const replay::Store& store, const replay::PlayPlan& plan, const BodyOptions& options,
            const std::map<std::string, double>& joints, const std::function<bool()>& is_stopped,
            replay::PlayReport& report);

}  // namespace afterglow::nodes

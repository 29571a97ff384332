/// \file
/// The player: sends a behavior's messages when they are due, rewritten to be right now, and leaves
/// the robot standing and the floor dark when it is done, however it ends.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "replay/motion/base_drive.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/motion/milestones.hpp"
#include "replay/play/arm_lead.hpp"
#include "replay/play/body_in_force.hpp"
#include "replay/play/driven_base.hpp"
#include "replay/play/ledger.hpp"
#include "replay/play/outbox.hpp"
#include "replay/play/play_options.hpp"
#include "replay/play/play_report.hpp"
#include "replay/play/scheduler.hpp"
#include "replay/play/step_gate.hpp"
#include "replay/play/transport.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// One replay. Deadlines are absolute; order is receive stamp, then sequence. What is late:
/// - by 2 ms and overtaken by the next of its topic: skipped, for velocities, goals and types of
///   which a message replaces the one before (clouds, scans, paths); markers are always sent;
/// - a velocity by 250 ms: skipped, the base has stopped by itself; never a zero one;
/// - any other motion by 1 s: the replay stops. Motion is never sent in a burst;
/// - light and speech without motion by 1 s: the replay goes on from there.
/// Velocities that are no numbers are never sent.
/// Rates scale velocities, trajectories and lifetimes (motion_rate.hpp).
/// A pause sends zero velocities, halts trajectory commands and cancels the goals under way;
/// resuming sends what is left of them, and the velocity in force. Another rate does both. seek()
/// does so, too, and first makes what is in force there so again (scene_at.hpp). An arm that is not
/// where a goal is to begin stops the replay, or is given time to get there (arm_start.hpp): the
/// timeline stands until then.
/// In step: nothing that was recorded after a goal's result (milestones.hpp), less a margin, is
/// sent before the live one; the timeline stands there and then leaps to the result. Nor does it
/// pass a base that is driven along its track. While it stands for a goal velocities are zero; they
/// are in force again after it. What the body does never waits for light or speech. Not where
/// recorded time is played: the robot's time is the replay's then, and stands when it does. A
/// modality fails: the body when a goal fails that did not when it was recorded, does not end in
/// time, or the base is lost; light and speech when a message is refused or nobody is there to get
/// it, or by fail(). What follows is PlayOptions::on_failure.
/// The end: a normal one waits for the goals and the drive under way, goals up to a bound. Then,
/// and after stop(), an error or a stall: goals that are still open are canceled, every velocity
/// topic that was played gets a zero, and projected topics are cleared.
///
/// Its parts: Scheduler (when), Transport (timeline, requests), Outbox (a message's way out),
/// BodyInForce with ArmLead and DrivenBase (what the body does), StepGate (what waits for it),
/// Ledger (the report).
class Player {
 public:
  /// Everything must outlive the player. `ros_now` gives ROS time, `ids` fresh goal ids. Throws
  /// std::logic_error for options that are not for the body, if the plan moves it.
  Player(const Store& store, const PlayPlan& plan, const PlayOptions& options, MessageSink& sink,
         Clock& clock, std::function<Stamp()> ros_now, Rewriter::FreshId ids);
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  /// Plays; returns when all is over, cleaned up. The calling thread is the scheduler. Once.
  PlayReport run();

  // Any thread, also before run(). A request that is not possible is refused by std::runtime_error,
  // one line.
  void stop(const std::string& reason) { transport_.stop(reason); }
  void pause() { transport_.pause(); }
  void resume() { transport_.resume(); }
  /// Stands as in a pause, without being paused: somebody has to catch up. For light and speech
  /// only, and not beyond the last message.
  void hold(bool holds) { transport_.hold(holds); }
  /// Limits of the body are the caller's.
  void setRate(double rate) { transport_.setRate(rate); }
  /// To so far into the behavior, within the part that is played.
  void seek(PlaybackTime position) { transport_.seek(position); }
  /// The next so many messages at once. Refused unless paused, and for the body.
  void playNext(std::uint64_t count) { transport_.playNext(count); }
  /// Whether pause topics pause; they do at first. Returns whether they do now.
  bool togglePauseTopics() { return transport_.togglePauseTopics(); }
  /// A goal's status, seen on its action server's status topic; ids that are not ours are ignored.
  void onGoalStatus(const std::string& id, std::uint8_t goal_status);
  /// A modality has failed, says somebody who knows: the speaker.
  void fail(Modality modality, const std::string& why) { transport_.fail(modality, why); }
  PlayProgress progress() const;
  bool isPauseWanted() const { return transport_.isPauseWanted(); }

 private:
  const PlayPlan& plan_;
  const PlayOptions options_;
  Clock& clock_;
  const Milestones milestones_;
  GoalBook own_goals_;  ///< unless the options give one
  GoalBook& goals_;
  Transport transport_;
  Ledger ledger_;
  ArmLead lead_;
  Outbox outbox_;
  StepGate gate_;
  DrivenBase base_;
  BodyInForce body_;
  Scheduler scheduler_;
};

}  // namespace afterglow::replay

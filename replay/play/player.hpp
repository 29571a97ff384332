/// \file
/// The player: sends a behavior's messages when they are due, rewritten to be right now, and leaves
/// the robot standing and the floor dark when it is done, however it ends.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "replay/motion/base/base_drive.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/motion/milestones.hpp"
#include "replay/play/body_in_force.hpp"
#include "replay/play/ledger.hpp"
#include "replay/play/outbox.hpp"
#include "replay/play/play_report.hpp"
#include "replay/play/scheduler.hpp"
#include "replay/play/step_gate.hpp"
#include "replay/play/transport.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// A replay. Deadlines are absolute; order is receive stamp, then sequence. Late messages:
/// - 2 ms late and overtaken by the next message of its topic: skipped, if it is a velocity, a goal
///   or of a type of which a message replaces the one before (clouds, scans, paths); markers are
///   always sent;
/// - a velocity that is 250 ms late: skipped, the base has stopped by itself; zero velocities are
///   always sent;
/// - any other motion that is 1 s late: the replay stops. Motion is never sent in a burst;
/// - light and speech without motion, 1 s late: the replay goes on from there.
/// Velocities that are not finite are never sent.
/// Rates scale velocities, trajectories and lifetimes (motion_rate.hpp).
/// A pause sends zero velocities, halts trajectory commands and cancels the open goals; resuming
/// sends the rest of them, and the velocity in force. Another rate does both. seek() does both,
/// too, and in between puts goals, commands and light of the new moment in force (scene_at.hpp). An
/// arm that is not where its goal begins stops the replay, or is given time to get there
/// (arm_start.hpp): the timeline stands until then.
/// In step: a message that was recorded after a goal's result (milestones.hpp), less a margin, is
/// not sent before the live result; the timeline stands there and then leaps to the result. Nor
/// does the timeline pass a base that is driven along its track. While it stands for a goal
/// velocities are zero; after it they are in force again. The body never waits for light or speech.
/// Nothing waits where recorded time is played: the robot's time is the replay's then and stands
/// with it.
/// Failures: the body fails when a goal fails that did not when it was recorded, when a goal does
/// not end in time, and when the base is lost; light and speech fail when a message is refused or
/// has no subscriber, or by fail(). PlayOptions::on_failure says what follows.
/// The end: a normal one waits for the open goals, up to a bound, and for the drive under way.
/// Then, and after stop(), an error or a stall: open goals are canceled, every velocity topic that
/// was played gets a zero velocity, and projected topics are cleared.
///
/// The parts: Scheduler (the loop), Transport (timeline and requests), Outbox (a message's way to
/// its publisher), BodyInForce with ArmLead and DrivenBase (goals, commands, the base), StepGate
/// (keeps in step), Ledger (the report).
class Player {
 public:
  /// Everything must outlive the player. `ros_now` gives ROS time, `ids` fresh goal ids. Throws
  /// std::logic_error for options that are not for the body, if the plan moves it.
  Player(const Store& store, const PlayPlan& plan, const PlayOptions& options, MessageSink& sink,
         Clock& clock, const std::function<Stamp()>& ros_now, Rewriter::FreshId ids);
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
  /// Stands as in a pause, whatever resume() says: nobody holds the button that lets it move.
  void halt(bool halts) { transport_.halt(halts); }
  /// Limits of the body are the caller's.
  void setRate(double rate) { transport_.setRate(rate); }
  /// Seeks so far into the behavior, within the part that is played.
  void seek(PlaybackTime position) { transport_.seek(position); }
  /// The next so many messages at once. Refused unless paused, and for the body.
  void playNext(std::uint64_t count) { transport_.playNext(count); }
  /// Switches pauses at pause topics, which are on at first. Returns whether they do now.
  bool togglePauseTopics() { return transport_.togglePauseTopics(); }
  /// A goal's status, seen on its action server's status topic; ids that are not ours are ignored.
  void onGoalStatus(const std::string& id, const GoalEnd& end);
  /// A modality has failed, says somebody who knows: the speaker.
  void fail(Modality modality, const std::string& why) { transport_.fail(modality, why); }
  PlayProgress progress() const;
  bool isPauseWanted() const { return transport_.isPauseWanted(); }

 private:
  const PlayPlan& plan_;
  const PlayOptions options_;
  const Milestones milestones_;
  GoalBook own_goals_;  ///< unless the options give one
  GoalBook& goals_;
  Transport transport_;
  Ledger ledger_;
  const PlayContext play_;
  ArmLead lead_;
  Outbox outbox_;
  StepGate gate_;
  DrivenBase base_;
  BodyInForce body_;
  Scheduler scheduler_;
};

}  // namespace afterglow::replay

/// \file
/// The player: one scheduler that sends a behavior's messages when they are due, rewritten to be
/// right now, and leaves the robot standing and the floor dark when it is done, however it ends.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/clock/clock.hpp"
#include "replay/clock/timeline.hpp"
#include "replay/motion/arm_start.hpp"
#include "replay/motion/base_drive.hpp"
#include "replay/motion/goal_book.hpp"
#include "replay/motion/milestones.hpp"
#include "replay/motion/motion_rate.hpp"
#include "replay/plan/anchoring.hpp"
#include "replay/plan/modality_options.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/plan/rewrite.hpp"
#include "replay/play/message_lanes.hpp"
#include "replay/play/play_report.hpp"
#include "replay/play/scene_at.hpp"
#include "replay/play/skew.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Where messages go.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  /// True if somebody listens on the topic. May throw: the message counts as refused.
  virtual bool publish(const Channel& channel, const Bytes& bytes) = 0;
};

struct PlayOptions {
  double rate = 1.0;
  bool clear_projection = true;
  double hold_s = 2.0;  ///< how long the light stays after the end before it is cleared
  /// How long goals may take beyond their recorded end, or the replay's.
  double goal_wait_s = 10.0;
  std::size_t prefetch_bytes = 64u << 20;
  bool is_looping = false;    ///< for light and speech only: the body ends where it did not begin
  bool is_immediate = false;  ///< as fast as it goes; for light and speech only
  bool starts_paused = false;
  bool keeps_alive = false;  ///< the end comes with stop() only
  /// Of a time without messages, only so much is played. At least 0.5 s where the body moves, so
  /// that a base has stopped by itself, and not while goals are under way.
  std::optional<double> skip_empty_s;
  std::set<std::string> pause_topics;  ///< pauses before each message on them
  /// Stamps are left as they were: whoever listens is given recorded time as well.
  bool has_recorded_time = false;
  /// After seek(), how long the arm has at least to get to where its trajectory goes on, if it is
  /// elsewhere.
  double seek_lead_s = 5.0;
  MessageAnchor* anchor = nullptr;  ///< of the light, if any; outlives the player
  /// What is recorded after a goal's result, or after where the base got to, waits for that.
  bool is_in_step = true;
  ModalityLatency latency_s;  ///< so much earlier messages go out
  FailurePolicy on_failure;
  /// Drives the base instead of the recorded velocities on its topic, which has to be played, and
  /// not in recorded time. Outlives the player.
  BaseDrive* base_drive = nullptr;
  /// Has joint trajectories begin where the joints are, or stops the replay; outlives the player.
  /// None: they are sent as they were recorded.
  ArmStart* arm_start = nullptr;
  /// The frame that looks along its x axis with a head whose controller jumps after a cancel
  /// (presentGaze()); empty: no such head.
  std::string gaze_frame;
};

struct PlayProgress {
  enum class State { Idle, Playing, Paused } state = State::Idle;
  bool is_held = false;  ///< playing, but hold() keeps it standing
  PlaybackTime position;
  double rate = 1;
  std::uint64_t published = 0;
};

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
class Player {
 public:
  /// Everything must outlive the player. `ros_now` gives ROS time, `ids` fresh goal ids. Throws
  /// std::logic_error for options that are not for the body, if the plan moves it.
  Player(const Store& store, const PlayPlan& plan, const PlayOptions& options, MessageSink& sink,
         Clock& clock, std::function<Stamp()> ros_now, Rewriter::FreshId ids);
  ~Player();
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  /// Plays; returns when all is over, cleaned up. The calling thread is the scheduler. Once.
  PlayReport run();

  // player_commands.cpp. Any thread, also before run(). What is not possible is refused by
  // std::runtime_error, one line.
  void stop(const std::string& reason);
  void pause();
  void resume();
  /// Stands as in a pause, without being paused: somebody has to catch up. For light and speech
  /// only, and not beyond the last message.
  void hold(bool holds);
  /// Limits of the body are the caller's.
  void setRate(double rate);
  /// To so far into the behavior, within the part that is played.
  void seek(PlaybackTime position);
  /// The next so many messages at once. Refused unless paused, and for the body.
  void playNext(std::uint64_t count);
  /// Whether pause topics pause; they do at first. Returns what is so now.
  bool togglePauseTopics();
  /// A goal's status, seen on its action server's status topic; ids that are not ours are ignored.
  void onGoalStatus(const std::string& id, std::uint8_t goal_status);
  /// A modality has failed, says somebody who knows: the speaker.
  void fail(Modality modality, const std::string& why);
  PlayProgress progress() const;
  bool isPauseWanted() const;

 private:
  /// A command as it was recorded, of which it may be only the rest that is sent.
  struct Recorded {
    Bytes bytes;
    Stamp at;
  };
  struct Topic {
    const PlannedTopic* planned = nullptr;
    std::unique_ptr<MotionRate> scaling;
    bool is_velocity = false, is_replacing = false;
    bool is_driven = false;  ///< the base drive's
    double latency_s = 0;
    bool has_moved = false;  ///< a velocity was sent
    Recorded command;        ///< the velocity or trajectory command in force
    TopicReport report;
    Bytes last;  ///< projected content in force
  };
  struct Due {
    Message message;
    const Channel* channel = nullptr;
    Topic* topic = nullptr;
    SteadyTime deadline;
  };
  /// Why a wait is over.
  enum class Wake { Due, Moved, Stopped };
  /// What other threads want.
  struct Requests {
    std::optional<std::string> stop_reason;
    bool pause = false, hold = false;
    std::optional<double> rate;
    std::optional<Stamp> seek;
    std::uint64_t steps = 0;
  };

  // player.cpp: what is sent.
  void play();
  bool playRound();
  void playDue();
  void leapAfterStall(Stamp recorded);
  std::vector<Due> takeDue(SteadyTime now);
  void send(Due& due);
  bool isOvertaken(const std::vector<Due>& batch, std::size_t index, SteadyTime now) const;
  bool isTooLate(const Due& due, std::int64_t late_ns) const;
  PublishMoment momentOf(Stamp received, std::int64_t late_ns, std::int64_t early_ns);
  void publish(Topic& topic, const Channel& channel, Stamp received, Bytes bytes,
               std::int64_t late_ns, const Recorded* origin = nullptr);
  void publishAt(Topic& topic, const Channel& channel, Stamp at, Recorded recorded, Bytes bytes,
                 const PublishMoment& moment, std::int64_t late_ns);
  void noteSent(Topic& topic, Stamp recorded, std::int64_t late_ns);

  // player_in_step.cpp: what the body has done, and what waits for it.
  bool keepInStep();
  bool isGated() const;
  void driveBase();
  void addGoal(GoalBook::Entry entry);
  bool repeatHeadGoal(const GoalBook::Ended& ended);
  void followEnd(const GoalBook::Ended& ended);
  bool isWaitedFor(const std::optional<Milestone>& milestone) const;
  bool moveLimit(std::optional<GoalBook::Ended> reached);
  void setLimit(std::optional<Stamp> limit, const std::optional<GoalBook::Ended>& reached);
  void standWhileHeld();
  void noteWait(Stamp at, SteadyTime since, double seconds);
  void endWait();
  void forgetSteps();
  void giveUpGoals();
  bool isHeldByGoal() const;
  SteadyTime nextStep() const;
  std::int64_t marginNow() const;
  std::int64_t longestWait() const;
  SteadyTime deadlineOf(Stamp recorded, std::int64_t early_ns) const;
  double playedSeconds(SteadyTime now) const;
  double recordedSeconds(Stamp recorded) const;

  // player_control.cpp: waits, and what other threads want.
  Wake waitUntil(Stamp recorded, std::int64_t early_ns);
  Wake waitFor(double seconds, const std::function<bool()>& is_over);
  std::optional<Stamp> leapBefore(Stamp recorded) const;
  void leapTo(Stamp recorded);
  bool pausesBefore(const Message& message);
  Wake followRequests();
  void suspend();
  void proceed();
  void sendRest(Topic& topic, const Channel& channel, const Recorded& whole, std::int64_t lead_ns);
  Bytes restOf(const Channel& channel, const Recorded& whole, Stamp at, std::int64_t lead_ns) const;
  void sendVelocityInForce(Topic& topic, Stamp at);
  double leadToProceed(const std::vector<GoalBook::Entry>& goals, Stamp at);
  std::optional<double> leadOf(const Channel& channel, const Recorded& whole, Stamp at) const;
  void giveTime(double seconds, Stamp at);
  void beginWhereJointsAre(const Topic& topic, const Channel& channel, Stamp at, Bytes& bytes);
  void lookAtHaltedJoints();
  void holdGaze(const std::vector<GoalBook::Entry>& goals);
  void followRate(double rate);
  bool step();

  // player_seek.cpp: the middle of a behavior.
  void enter(Stamp at);
  void moveTo(Stamp to);
  SceneAt readScene(Stamp at);
  void showLight(const SceneAt& scene, Stamp at);
  void setTargets(const SceneAt& scene);

  // player_end.cpp: the end, and what brings the robot to rest.
  Wake endRound();
  void measureLength();
  Wake waitForBase();
  Wake waitForGoals();
  void finish();
  void sendZeroVelocities();
  void sendZeroVelocity(const Topic& topic);
  void haltCommands();
  void sendCancels(const std::vector<GoalBook::Entry>& goals);
  void clearProjection();
  void trySend(const Channel& channel, const Bytes& bytes);
  void note(const std::string& problem);
  void addDamage(MessageLanes& lanes);

  Topic* topicOf(const Channel& channel);
  const Channel& channelOf(std::int64_t id);
  bool isStopped() const;
  void changeTimeline(const std::function<void(Timeline&)>& change);

  const Store& store_;
  const PlayPlan& plan_;
  const PlayOptions options_;
  const bool has_motion_;
  MessageSink& sink_;
  Clock& clock_;
  const std::function<Stamp()> ros_now_;
  Rewriter rewriter_;
  GoalBook goals_;
  Milestones milestones_;

  // The scheduler's.
  std::map<std::string, Topic> topics_;
  std::map<std::int64_t, Channel> channels_;
  std::optional<std::int64_t> shift_ns_;        ///< what recorded stamps are moved by
  Stamp played_until_;                          ///< the last message's, for gaps
  std::optional<std::uint64_t> paused_before_;  ///< the sequence of a pause topic's message
  bool needs_lead_ = false;                     ///< targets are to be sent with time to get there
  SteadyTime lead_end_;                         ///< until then they have that time
  SteadyTime halt_look_ = SteadyTime::forever();  ///< when halted joints have come to rest
  SteadyTime first_deadline_;
  std::int64_t paused_ns_ = 0;  ///< in all
  SteadyTime paused_at_, resumed_at_;
  bool has_ended_ = false, has_next_ = false;
  std::set<std::uint64_t> damaged_;  ///< messages that were left out, by sequence
  PlayReport report_;

  // In step.
  std::optional<Stamp> asked_limit_;  ///< of the timeline, which may have passed it
  bool is_goal_limit_ = false;        ///< it is a goal's, not the base's
  std::string awaited_;               ///< the topic that sets it
  bool is_standing_ = false;          ///< velocities are zero because it is held
  Stamp lifted_from_;                 ///< the last limit that held, and until when
  SteadyTime lifted_at_;
  SteadyTime next_base_step_;
  std::optional<PlayWait> wait_;  ///< may go on
  double wait_end_s_ = 0;
  std::map<std::pair<std::string, std::int64_t>, std::size_t> spans_;  ///< of goals, in the report
  std::map<std::pair<std::string, std::int64_t>, int> head_repeats_;  ///< of goals
  Skew skew_;
  Samples deviation_;  ///< of the base

  mutable std::mutex mutex_;
  std::optional<Timeline> timeline_;     ///< changed by the scheduler only
  std::unique_ptr<MessageLanes> lanes_;  ///< the same
  Requests requests_;
  std::map<Modality, ModalityFailures> failures_;
  bool has_pause_topics_ = true;
  std::uint64_t published_ = 0;
};

}  // namespace afterglow::replay

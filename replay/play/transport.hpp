/// \file
/// The way in which a plan is played, the timeline of the replay, and the requests of other threads:
/// stop, pause, rate, seek.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "replay/clock/clock.hpp"
#include "replay/clock/timeline.hpp"
#include "replay/plan/play_plan.hpp"
#include "replay/plan/topic_role.hpp"
#include "replay/play/ledger.hpp"
#include "replay/play/play_report.hpp"

namespace afterglow::replay {

class ArmStart;
class BaseDrive;
class GoalBook;
class MessageAnchor;

struct PlayOptions {
  double rate = 1.0;
  bool clear_projection = true;
  double hold_s = 2.0;  ///< time the light stays after the end before it is cleared
  /// The time that goals may take beyond their recorded end, or the replay's.
  double goal_wait_s = 10.0;
  std::size_t prefetch_bytes = 64u << 20;
  bool is_looping = false;    ///< true only without the body, which ends elsewhere
  bool is_immediate = false;  ///< true: as fast as it goes; for light and speech only
  bool starts_paused = false;
  bool keeps_alive = false;  ///< the end comes with stop() only
  /// The part that is played of a time without messages. At least 0.5 s where the body moves, so
  /// that a base has stopped by itself, and not while goals are under way.
  std::optional<double> skip_empty_s;
  std::set<std::string> pause_topics;  ///< pauses before each message on them
  /// Stamps are left as they were: whoever listens is given recorded time as well.
  bool has_recorded_time = false;
  /// The least time after seek() that the arm has to get to where its trajectory goes on, if it is
  /// elsewhere.
  double seek_lead_s = 5.0;
  MessageAnchor* anchor = nullptr;  ///< anchor of the light, if any; outlives the player
  /// True: what is recorded after a goal's result, or after where the base got to, waits for that.
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
  /// The book of open goals, if others look into it; outlives the player. None: a book of its own.
  GoalBook* goals = nullptr;
};

class MessageLanes;

struct PlayProgress {
  enum class State { Idle, Playing, Paused } state = State::Idle;
  bool is_held = false;  ///< playing, but hold() keeps it standing
  PlaybackTime position;
  double rate = 1;
  std::uint64_t published = 0;
  /// The worst of the last half to whole second: how late messages went out, and how far light and
  /// speech were from the body. Empty: there was nothing to measure.
  std::optional<double> late_ms, skew_ms;
};

/// Any thread may make requests; the thread that plays takes them and is the only one that changes
/// the timeline. Everything given outlives the transport.
class Transport {
 public:
  /// Takes the clock that requests to the playing thread wake.
  Transport(const PlayPlan& plan, const PlayOptions& options, Clock& clock);

  // Any thread, also before begin(). A request that is not possible is refused by
  // std::runtime_error, one line.
  void stop(const std::string& reason);
  void pause();
  void resume();
  void hold(bool holds);
  void halt(bool halts);
  void setRate(double rate);
  void seek(PlaybackTime position);
  void playNext(std::uint64_t count);
  bool togglePauseTopics();
  /// Stops the replay if the options say so of this modality.
  void fail(Modality modality, const std::string& why);
  bool isPauseWanted() const;
  bool isStopped() const { return stopReason().has_value(); }
  /// The first one.
  std::optional<std::string> stopReason() const;
  /// Returns the progress without what is known of published messages.
  PlayProgress progress() const;
  std::map<Modality, ModalityFailures> failures() const;

  // The thread that plays.
  /// The orders for the thread that plays. Each rate, seek and step is given once.
  struct Orders {
    bool stops = false;  ///< nothing else is set then
    bool pauses = false, resumes = false;
    std::optional<double> rate;
    std::optional<Stamp> seek;
    std::uint64_t steps = 0;  ///< so many single messages
  };
  /// hold() holds only if a message is to come.
  Orders takeOrders(bool has_next);
  /// Returns true if the replay has to pause before this message of a pause topic; once for each
  /// message.
  bool pausesBefore(std::uint64_t sequence);
  /// A stop cancels the reading of these lanes. They outlive the next call, or the transport.
  void cancelOnStop(MessageLanes& lanes);
  /// The replay begins at this recorded moment, or goes on there, at `when`. The timeline has no
  /// limit then; it is paused at the begin if that was requested before.
  void enter(Stamp at, SteadyTime when);
  bool hasBegun() const { return timeline_.has_value(); }
  const Timeline& timeline() const { return *timeline_; }
  void change(const std::function<void(Timeline&)>& change);

 private:
  struct Requests {
    std::optional<std::string> stop_reason;
    bool pause = false, hold = false, halt = false;
    bool stands() const { return pause || halt; }
    std::optional<double> rate;
    std::optional<Stamp> seek;
    std::uint64_t steps = 0;
  };
  void request(const std::function<void(Requests&)>& ask);

  const PlayPlan& plan_;
  const PlayOptions& options_;
  Clock& clock_;
  mutable std::mutex mutex_;
  std::optional<Timeline> timeline_;
  MessageLanes* lanes_ = nullptr;
  Requests requests_;
  std::map<Modality, ModalityFailures> failures_;
  bool has_pause_topics_ = true;
  std::optional<std::uint64_t> paused_before_;  ///< the sequence of a pause topic's message
};

/// The things that all parts of the player share; they outlive every part.
struct PlayContext {
  const PlayPlan& plan;
  const PlayOptions& options;
  Clock& clock;
  Transport& transport;
  Ledger& ledger;

  const Timeline& timeline() const { return transport.timeline(); }
};

}  // namespace afterglow::replay

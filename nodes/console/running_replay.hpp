/// \file
/// The one replay that pages started here: it is stopped when who started it is gone, or lets go.
///
/// A process of its own that stops what the console started if the console dies.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "nodes/console/robot_links.hpp"
#include "replay/clock/worker_thread.hpp"
#include "replay/motion/stops/operator_stops.hpp"

namespace afterglow::nodes {

/// Any thread. A thread of its own looks every 20 ms whether a replay has to be stopped, and tells
/// the player again and again until it is.
class RunningReplay {
 public:
  static constexpr std::chrono::seconds kHoldPatience{30};  ///< until the first POST /api/hold

  struct Surroundings {
    /// Returns true if a page of this session listens to events.
    std::function<bool(const std::string& session)> is_listening;
    /// Called before a goal goes out, and after it has ended: DeadManSwitch.
    std::function<void(bool runs)> tell_dead_man_switch;
  };
  struct Start {
    PlayRequest request;
    std::string session;
    bool moves = false;
    bool is_held = false;         ///< goes out when the button is held, ends with that
    std::uint64_t after_stop = 0;  ///< stopCount() when it was asked for: a stop since forbids it
  };
  /// The state, for people.
  struct Shown {
    bool is_ours = false, waits_for_hold = false, is_stopping = false, moves = false;
    std::int64_t behavior = 0;
    std::string last;  ///< end of the last replay, in words
    std::uint64_t reports = 0;  ///< number of reports so far
  };
  /// The report of a replay that has ended.
  struct Report {
    std::int64_t behavior = 0;
    std::string ended;  ///< its end, in words
    std::string json;   ///< the player's (keys: replay/play/play_report.hpp)
  };

  RunningReplay(PlayerLink& player, Surroundings surroundings);
  /// Closes it.
  ~RunningReplay();
  /// Stops what runs, and waits for its end for up to 2 s; from then on nothing is started.
  void close();

  /// Waits until the player has begun or refused, up to 3 s. Throws HttpError 409 with its words.
  void start(const Start& start);
  /// The page's button is pressed, which a page says again and again (operator_stops.hpp). Returns
  /// whether that holds a replay.
  bool beat(const std::string& session);
  /// Whatever is replayed, by whomever it was started. False: the player does not hear it.
  bool stop(const std::string& reason);
  std::uint64_t stopCount() const;
  /// Throws HttpError 409 where what is replayed was not started here.
  void needOurs() const;
  Shown shown() const;
  /// Returns the report of the last replay that was started here and not refused.
  std::optional<Report> report() const;

 private:
  using Time = std::chrono::steady_clock::time_point;
  struct Current {
    std::string goal;
    Start start;
    bool is_sent = false;
    Time asked{};           ///< time of the request
    replay::HoldToRun hold;  ///< the page's button
    std::string reason;  ///< reason of its stop; empty: it is not being stopped
    Time canceled{};     ///< last
  };
  void tick();
  std::string whyStop(Time now) const;
  void send();
  void end(const std::string& words);

  PlayerLink& player_;
  const Surroundings surroundings_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Current> current_;
  std::string last_;
  std::optional<Report> report_;
  std::uint64_t reports_ = 0, stops_ = 0;
  bool is_ending_ = false;
  replay::TaskThread stopper_;  ///< calls ~stop, which may hang with its player
  replay::RepeatingThread thread_;
};

/// The console's end of the switch.
class DeadManSwitch {
 public:
  static constexpr const char* kArgument = "--dead-man-switch";

  /// Starts this program again, with the arguments `--dead-man-switch PLAYER`. Throws
  /// std::runtime_error.
  explicit DeadManSwitch(const std::string& player);
  /// The other process ends, without a word if nothing runs.
  ~DeadManSwitch();
  DeadManSwitch(const DeadManSwitch&) = delete;
  DeadManSwitch& operator=(const DeadManSwitch&) = delete;

  /// Tells whether a replay of ours is under way. Any thread, one at a time.
  void tell(bool runs) const;
  /// Returns false if nobody would stop the player.
  bool isThere() const;

 private:
  int pipe_ = -1;
  mutable pid_t pid_ = -1;
};

/// The other process: waits for the console's end, and has the player stop then if a replay was
/// under way. Returns the exit status.
int runDeadManSwitch(const std::string& player);

}  // namespace afterglow::nodes

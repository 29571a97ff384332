/// \file
/// The player's side of its watchdogs: tells them what is in motion, and sends motion only while
/// they are there.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "nodes/player/watchdog.hpp"
#include "replay/clock/clock.hpp"
#include "replay/motion/stops/motion_monitor.hpp"
#include "replay/motion/stops/patience.hpp"
#include "replay/play/outbox.hpp"
#include "replay/play/play_report.hpp"

namespace afterglow::nodes {

/// Stands between a player and the sink it publishes on. Everything given must outlive it. A player
/// that sleeps on clock() has its scheduler watched: by the process beside it, by the guard on the
/// robot where one runs, and by its own look at the clock: what hung, or slept with its machine,
/// for longer than the watchdogs wait does not drive on.
class GuardedSink : public replay::MessageSink {
 public:
  /// Starts the watchdog, which lies beside the running program. `longest_stall_s`: how long the
  /// player may hang in motion; empty: by how late this machine is (patience.hpp). `on_lost` is
  /// called once, by the thread that publishes or sleeps, when a watchdog is gone or has stopped
  /// the robot. Throws std::runtime_error, one line.
  GuardedSink(const replay::PlayPlan& plan, replay::MessageSink& sink, replay::Clock& clock,
              std::optional<double> longest_stall_s,
              std::function<void(const std::string& reason)> on_lost);
  /// Tells the watchdogs that all is over.
  ~GuardedSink() override;
  GuardedSink(const GuardedSink&) = delete;
  GuardedSink& operator=(const GuardedSink&) = delete;

  /// Waits until the watchdogs are connected to whoever listens, and their patience is known.
  /// Throws std::runtime_error, one line, if they do not get ready.
  void waitUntilReady(const std::function<bool()>& is_stopped);
  /// Returns why nothing may move, by the graph now: a bridge to ROS 2 hears what is played that
  /// was not known when this began. Empty: it may.
  std::string whyUnwatched(const RosGraph& graph) const;
  /// Returns the guards after that: who watches, and how long.
  replay::PlayGuards guards() const;

  /// Throws std::runtime_error for a message that moves the robot, without the watchdogs.
  bool publish(const replay::Channel& channel, const replay::Bytes& bytes) override;
  /// Has the watchdogs stop the robot now. Any thread.
  void brake();
  /// A goal's final status was seen. One that was aborted is halted. Any thread.
  void goalEnded(const std::string& id);
  /// Something was set in motion here. Any thread.
  bool hasMoved() const;
  /// Watches the gripper's place, whenever it moves; `gap` is called by any thread, and empty: not
  /// known.
  void watchGap(std::function<std::optional<double>()> gap);
  /// All goals that are sent here. Any thread.
  replay::GoalBook& goals() { return watch_.goals(); }
  replay::BeatingClock& clock() { return clock_; }

 private:
  void tick();
  std::string unready() const;
  void beat();
  // With the lock held:
  void tellOutputs();
  void sendBeat();
  void listen();
  void lookAtOwnPulse();
  bool isReady();
  void lose(const std::string& reason);

  /// The player's own pulse, as the watchdogs see it.
  struct Pulse {
    replay::BeatJitter jitter;
    bool is_settled = false;          ///< true: it is known how long the watchdogs wait
    replay::MachineLateness machine;  ///< lateness of the machine then
    std::int64_t patience_ns = 0;
    replay::SteadyTime last_beat;
  };

  replay::MessageSink& sink_;
  const std::function<void(const std::string&)> on_lost_;
  const std::optional<double> longest_stall_s_;
  replay::BeatingClock clock_;
  mutable std::mutex mutex_;
  replay::MotionMonitor watch_;
  std::function<std::optional<double>()> gap_;
  std::vector<std::string> topics_;  ///< of what moves the body, and of its stops
  std::map<std::string, std::set<std::string>> listeners_on_ros2_;  ///< bridges by topic
  std::vector<Watchdog> watchdogs_;  ///< beside the player, and on the robot if one runs there
  std::string robot_guard_;          ///< the last one's node
  Pulse pulse_;
  std::string lost_;  ///< the reason why motion is not watched any more
  bool has_told_ = false, has_moved_ = false;
  bool is_over_ = false;
  std::condition_variable over_;
  std::thread ticker_;
};

}  // namespace afterglow::nodes

/// \file
/// The player's side of its watchdog: starts it, tells it what is in motion, and sends motion only
/// while it is there.
#pragma once

#include <sys/types.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "nodes/player/guard_link.hpp"
#include "replay/clock/beating_clock.hpp"
#include "replay/motion/motion_watch.hpp"
#include "replay/play/outbox.hpp"

namespace afterglow::nodes {

/// What the watchdog of this node is called.
std::string guardName();

/// Between a player and the sink it publishes on. Everything given must outlive it. A player that
/// sleeps on clock() has its scheduler watched.
class GuardedSink : public replay::MessageSink {
 public:
  /// Starts the watchdog, which lies beside the running program. `on_lost` is called once, by the
  /// thread that publishes or sleeps, when the watchdog is gone or has stopped the robot. Throws
  /// std::runtime_error, one line.
  GuardedSink(const replay::PlayPlan& plan, replay::MessageSink& sink, replay::Clock& clock,
              double longest_stall_s, std::function<void(const std::string& reason)> on_lost);
  /// Tells the watchdog that all is over.
  ~GuardedSink() override;
  GuardedSink(const GuardedSink&) = delete;
  GuardedSink& operator=(const GuardedSink&) = delete;

  /// Until the watchdog is connected to whoever listens. Throws std::runtime_error, one line, if
  /// it does not get ready.
  void waitUntilReady(const std::function<bool()>& is_stopped);

  /// Throws std::runtime_error for a message that moves the robot, without the watchdog.
  bool publish(const replay::Channel& channel, const replay::Bytes& bytes) override;
  /// Has the watchdog stop the robot now. Any thread.
  void brake();
  /// A goal's final status was seen. Any thread.
  void goalEnded(const std::string& id);
  /// All goals that are sent here. Any thread.
  replay::GoalBook& goals() { return watch_.goals(); }
  replay::BeatingClock& clock() { return clock_; }

 private:
  void start(double longest_stall_s);
  void tick();
  void tellOutput(std::uint32_t output);
  void beat();
  void send(const nlohmann::json& message);
  void listen();
  void lose(const std::string& reason);

  replay::MessageSink& sink_;
  const std::function<void(const std::string&)> on_lost_;
  replay::BeatingClock clock_;
  std::mutex mutex_;
  replay::MotionWatch watch_;
  std::unique_ptr<GuardLink> link_;
  pid_t pid_ = -1;
  int unanswered_ = 0;  ///< beats
  bool is_ready_ = false;
  std::string lost_;  ///< why there is no watchdog any more
  bool has_told_ = false;
  bool is_over_ = false;
  std::condition_variable over_;
  std::thread ticker_;
};

}  // namespace afterglow::nodes

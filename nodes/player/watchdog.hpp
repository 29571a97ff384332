/// \file
/// A watchdog of a replay as its player sees it: the process beside it (guard_process.hpp), and the
/// guard on the robot (robot_guard.hpp). It stops what is in motion when the player is gone.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "replay/motion/motion_watch.hpp"

namespace afterglow::nodes {

/// One thread at a time. What it is told is sent at once and never blocks.
class Watchdog {
 public:
  virtual ~Watchdog() = default;
  Watchdog() = default;
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// What stops the outputs: all that there are, once; later whenever one of them has changed.
  virtual void tellOutputs(const std::vector<replay::MotionWatch::Output>& outputs) = 0;
  virtual void tellOutput(const std::vector<replay::MotionWatch::Output>& outputs,
                          std::uint32_t changed) = 0;
  /// The player lives, and these outputs are in motion. Without another beat within `patience_ns`
  /// they are stopped.
  virtual void beat(const replay::Outputs& moving, std::int64_t patience_ns) = 0;
  /// The robot has to stop now.
  virtual void stop() = 0;
  /// All is over, and the robot stands.
  virtual void end() = 0;

  /// Takes in what it has answered. Before isReady() and whyLost().
  virtual void listen() = 0;
  /// It is connected to whoever listens on the outputs.
  virtual bool isReady() const = 0;
  /// Why it watches no more: a clause. Empty: it does.
  virtual const std::string& whyLost() const = 0;
};

}  // namespace afterglow::nodes

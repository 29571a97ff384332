/// \file
/// The way to the watchdog beside the player, a process of its own: afterglow_replay_guard.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "nodes/guard/guard_socket.hpp"
#include "nodes/player/watchdog.hpp"

namespace afterglow::nodes {

/// Returns the name of this node's watchdog.
std::string guardName();

class GuardProcess : public GuardWay {
 public:
  /// Starts the program, which lies beside the running one. Throws std::runtime_error, one line.
  GuardProcess();
  /// Waits until it has ended, and ends it if that takes too long.
  ~GuardProcess() override;

  void send(const GuardOutputs& outputs) override { socket_->send(outputs); }
  void send(const GuardBeat& beat) override { socket_->send(beat); }
  GuardAnswer answer() override;
  bool isOpen() override { return !socket_->isClosed(); }
  bool isSure() const override { return true; }

 private:
  std::optional<GuardSocket> socket_;  ///< until the process has to end
  pid_t pid_ = -1;
  GuardAnswer answer_;
};

}  // namespace afterglow::nodes

/// \file
/// The watchdog beside the player, a process of its own: afterglow_replay_guard (replay_guard.hpp).
#pragma once

#include <sys/types.h>

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "nodes/player/guard_link.hpp"
#include "nodes/player/watchdog.hpp"

namespace afterglow::nodes {

/// What the watchdog of this node is called.
std::string guardName();

class GuardProcess : public Watchdog {
 public:
  /// Starts the program, which lies beside the running one. Throws std::runtime_error, one line.
  GuardProcess();
  /// Waits until it has ended, and ends it if that takes too long.
  ~GuardProcess() override;

  void tellOutputs(const std::vector<replay::MotionWatch::Output>& outputs) override;
  void tellOutput(const std::vector<replay::MotionWatch::Output>& outputs,
                  std::uint32_t changed) override;
  void beat(const replay::Outputs& moving, std::int64_t patience_ns) override;
  void stop() override;
  void end() override;
  void listen() override;
  bool isReady() const override { return is_ready_; }
  const std::string& whyLost() const override { return lost_; }

 private:
  GuardProcess(const std::pair<int, int>& ends);
  void start(int its_end);
  void send(const nlohmann::json& message);
  void lose(const std::string& reason);

  GuardLink link_;
  pid_t pid_ = -1;
  int unanswered_ = 0;  ///< beats
  bool is_ready_ = false;
  std::string lost_;
};

}  // namespace afterglow::nodes

/// \file
/// A process of its own that stops what the console started if the console dies.
#pragma once

#include <sys/types.h>

#include <string>

namespace afterglow::nodes {

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

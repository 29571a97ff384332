/// \file
/// Stops what the console started if the console dies: a process of its own, which notices.
#pragma once

#include <sys/types.h>

#include <string>

namespace afterglow::nodes {

/// The console's end.
class Farewell {
 public:
  static constexpr const char* kArgument = "--farewell";

  /// Starts this program again, as `console_node --farewell PLAYER`. Throws std::runtime_error.
  explicit Farewell(const std::string& player);
  /// The other process ends, without a word if nothing runs.
  ~Farewell();
  Farewell(const Farewell&) = delete;
  Farewell& operator=(const Farewell&) = delete;

  /// Whether a replay of ours is under way. Any thread, one at a time.
  void tell(bool runs) const;
  /// False: nobody would stop the player.
  bool isThere() const;

 private:
  int pipe_ = -1;
  mutable pid_t pid_ = -1;
};

/// The other process: waits for the console's end, and has the player stop then if a replay was
/// under way. Returns the exit status.
int runFarewell(const std::string& player);

}  // namespace afterglow::nodes

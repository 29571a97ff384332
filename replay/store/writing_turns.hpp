/// \file
/// Pauses of a long write, in which others can write. Internal to replay.
#pragma once

#include <chrono>
#include <thread>

namespace afterglow::replay {

/// Whoever waits for a SQLite store looks every 2 ms whether it is free (sqlite.cpp): a pause of
/// 10 ms lets them in, also on a busy machine.
class WritingTurns {
 public:
  /// Gives way between two transactions.
  void next() {
    const auto now = std::chrono::steady_clock::now();
    if (now - begin_ < kTurn) return;
    std::this_thread::sleep_for(kPause);
    begin_ = std::chrono::steady_clock::now();
  }

 private:
  static constexpr std::chrono::milliseconds kTurn{100}, kPause{10};
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace afterglow::replay

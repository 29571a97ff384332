/// \file
/// The time between a message and its picture, by stages.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace afterglow::nodes {

/// The stages in the order of a picture's way.
enum class Stage {
  Arrived,    ///< a message's stamp to its callback: publisher, transport, queue
  Locked,     ///< the callback waits until the scene is free
  Converted,  ///< the message becomes content
  Scheduled,  ///< new content waits for its picture to begin
  Composed,   ///< the scene of this moment, with the wait for it
  Blended,    ///< several projectors share their light
  Drawn,
  Published,  ///< serialized and handed over; not yet received
};

/// The last times of each stage. Bounded; any thread.
class StageTimes {
 public:
  using Duration = std::chrono::steady_clock::duration;

  static constexpr std::size_t kKept = 256;  ///< times of each stage: 8 s at 30 Hz

  void add(Stage stage, Duration time);
  /// Name and "p50 3.1, p99 7.0 ms" of each stage that has any, in order.
  std::vector<std::pair<std::string, std::string>> words() const;

 private:
  struct Kept {
    std::vector<float> ms;
    std::size_t next = 0;  ///< index to be replaced, once it is full
  };
  mutable std::mutex mutex_;
  std::array<Kept, static_cast<std::size_t>(Stage::Published) + 1> stages_;
};

/// The time since it was made or last asked.
class Lap {
 public:
  StageTimes::Duration next() {
    const auto now = std::chrono::steady_clock::now();
    return now - std::exchange(at_, now);
  }

 private:
  std::chrono::steady_clock::time_point at_ = std::chrono::steady_clock::now();
};

}  // namespace afterglow::nodes

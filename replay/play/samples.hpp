/// \file
/// Measurements along a replay, thinned as they come: enough to draw a plot, in bounded memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace afterglow::replay {

/// A value at a moment: seconds into the behavior, and real seconds since the replay's first
/// deadline, pauses and waits included.
struct Sample {
  double recorded_s = 0, played_s = 0, value = 0;
};

/// A selection of at most kMost samples, in the order they were added. While there are few, all;
/// then of every 2, 4, 8 ... neighbors the one whose value is farthest from zero, so that peaks
/// stay.
class Samples {
 public:
  static constexpr std::size_t kMost = 2000;

  void add(const Sample& sample);
  const std::vector<Sample>& kept() const { return kept_; }
  /// Returns how many were added.
  std::uint64_t count() const { return count_; }

 private:
  std::vector<Sample> kept_;
  std::uint64_t count_ = 0;
  std::uint64_t group_ = 1;  ///< neighbors that one sample stands for
};

}  // namespace afterglow::replay

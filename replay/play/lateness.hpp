/// \file
/// The lateness of messages, over a replay of any length in fixed memory.
#pragma once

#include <array>
#include <cstdint>

namespace afterglow::replay {

/// Collects lateness in nanoseconds (below zero counts as zero). Quantiles are exact within 6 %
/// (logarithmic bins), count and maximum exactly. Drift is how much later the end ran than the
/// beginning: the mean of the last 64 less the mean of the first 64.
class Lateness {
 public:
  void add(std::int64_t nanoseconds);

  std::uint64_t count() const { return count_; }
  std::int64_t max() const { return max_; }
  /// 0 <= q <= 1; 0 when nothing was added. The upper edge of the bin it falls in.
  std::int64_t quantile(double q) const;
  double drift() const;

 private:
  static constexpr std::size_t kBinsPerOctave = 12;
  static constexpr std::size_t kEdge = 64;  ///< messages that count as beginning and as end

  std::array<std::uint64_t, kBinsPerOctave * 63 + 1> bins_{};
  std::array<std::int64_t, kEdge> last_{};
  std::int64_t first_sum_ = 0;
  std::uint64_t count_ = 0;
  std::int64_t max_ = 0;
};

}  // namespace afterglow::replay

/// \file
/// The pace of pictures where there is more to draw than time.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>

namespace afterglow::nodes {

/// While most of the last pictures take longer than their period, all begin as far apart as the
/// slowest of them takes: content moves evenly instead of by fits and starts. One slow picture
/// among quick ones changes nothing.
class EvenPace {
 public:
  using Duration = std::chrono::steady_clock::duration;

  explicit EvenPace(Duration period) : period_(period) {}

  /// Takes the time that a picture took to be drawn and published.
  void add(Duration drawing);
  /// Returns the time from one picture's beginning to the next one's; the period, unless there is
  /// more to draw.
  Duration interval() const;

 private:
  const Duration period_;
  std::array<Duration, 9> last_{};  ///< an odd number, for a median
  std::size_t next_ = 0;
};

}  // namespace afterglow::nodes

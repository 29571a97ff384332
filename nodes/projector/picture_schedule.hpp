/// \file
/// The moments at which projector_node draws: new content at once, the rest at a steady rate, and
/// all at an even pace where there is more to draw than time.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <optional>

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
  /// Returns the median of those times.
  Duration usual() const;

 private:
  const Duration period_;
  std::array<Duration, 9> last_{};  ///< an odd number, for a median
  std::size_t next_ = 0;
};

/// announce() and stop() from any thread, the rest from the thread that draws.
class PictureSchedule {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit PictureSchedule(double rate_hz);

  /// There is new content: the next picture is due now, or half a period after the last one that
  /// was announced.
  void announce();
  /// Ends the drawing; awaitDue() returns at once from now on.
  void stop();
  bool isStopped() const;
  /// Returns how long a picture usually takes to be drawn and published.
  std::chrono::steady_clock::duration usual() const { return pace_.usual(); }
  /// Waits until the next picture is due after the one that was begun at `drawn_at` and is finished
  /// now. `is_waiting`: content waits for a transform, which may come at any time. Returns how long
  /// the oldest new content has waited; nothing: there is none.
  std::optional<std::chrono::steady_clock::duration> awaitDue(Time drawn_at, bool is_waiting);

 private:
  Time regularDue(Time drawn_at, bool is_waiting) const;

  const std::chrono::steady_clock::duration period_;
  EvenPace pace_;
  mutable std::mutex mutex_;  ///< all below
  std::condition_variable woken_;
  bool has_news_ = false, is_stopped_ = false;
  Time news_at_;  ///< time of the first news, where has_news_
  Time news_drawn_at_ = Time::min();
};

}  // namespace afterglow::nodes

/// \file
/// The figures of a report, in bounded memory: samples along a replay, the lateness of its
/// messages, and the distance of light and speech from the body in time.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "replay/clock/clock.hpp"
#include "replay/motion/milestones.hpp"
#include "replay/plan/topic_role.hpp"

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

/// The largest value of the last half to whole second. One thread adds, without ever waiting; any
/// other asks.
class RecentWorst {
 public:
  /// `value` >= 0.
  void add(SteadyTime now, std::int64_t value) {
    const std::int64_t age = now.ns - since_;
    if (age >= kHalf_ns) {
      before_ = age < 2 * kHalf_ns ? newest_.load() : kNone;
      newest_ = value;
      since_ = now.ns;
    } else {
      newest_ = std::max(newest_.load(), value);
    }
  }
  /// Empty: there was none for a second.
  std::optional<std::int64_t> at(SteadyTime now) const {
    const std::int64_t age = now.ns - since_;
    const std::int64_t worst = age < kHalf_ns       ? std::max(before_.load(), newest_.load())
                               : age < 2 * kHalf_ns ? newest_.load()
                                                    : kNone;
    return worst == kNone ? std::nullopt : std::optional(worst);
  }

 private:
  static constexpr std::int64_t kHalf_ns = 500'000'000, kNone = -1;
  std::atomic<std::int64_t> since_{-2 * kHalf_ns};  ///< the newest half second began then
  std::atomic<std::int64_t> newest_{kNone}, before_{kNone};
};

/// The difference between the moments at which light or speech was published and where they were
/// recorded, relative to the body.
struct ModalitySkew {
  Lateness size;    ///< either way
  Samples samples;  ///< ms; above zero: later than the body
};

/// A message's skew is how far its moment is from where it was recorded relative to the body's last
/// milestone: the last that had been recorded by then, give or take kMilestoneMarginNs, whether it
/// was reached in time or not. Above zero: the message came later than the body. What was recorded
/// before the first milestone is not measured. One thread, but for recent().
class Skew {
 public:
  /// Takes the behavior's begin and the replay's first deadline, for the samples.
  void begin(Stamp begin, SteadyTime start);

  /// The body is on its way to a milestone; reach() is to follow.
  void expect(Stamp milestone);
  void reach(Stamp milestone, SteadyTime at);
  /// A message takes effect; its rate is in recorded seconds a second.
  void add(Modality modality, Stamp recorded, SteadyTime at, double rate);
  /// Forgets all milestones: the replay paused, or goes on elsewhere or at another rate.
  void restart();

  const std::map<Modality, ModalitySkew>& measured() const { return measured_; }
  /// ns, either way.
  const RecentWorst& recent() const { return recent_; }

 private:
  struct Reached {
    Stamp milestone;
    SteadyTime at;
  };
  struct Sent {
    Modality modality;
    Stamp recorded;
    SteadyTime at;
    double rate;
  };
  /// True if the message was measured or has no milestone to be measured by; false: later.
  bool measure(const Sent& sent);

  Stamp begin_;
  SteadyTime start_;
  std::vector<Stamp> expected_;
  std::deque<Reached> reached_;  ///< the last ones
  std::deque<Sent> early_;       ///< sent before the milestone they are measured by
  std::map<Modality, ModalitySkew> measured_;
  RecentWorst recent_;
};

}  // namespace afterglow::replay

/// \file
/// Whether a topic that is to be heard has fallen silent.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "replay/clock/clock.hpp"

namespace afterglow::replay {

/// A topic that is sent periodically may miss four periods, as they are measured. One that is sent
/// on change has no period and may be silent for ever. One thread.
class SilenceWatch {
 public:
  /// `longest_ns`: how long it may be silent, whatever its period; 0: by its period.
  explicit SilenceWatch(std::int64_t longest_ns = 0) : given_ns_(longest_ns) {}

  void heard(SteadyTime now);
  bool hasBeenHeard() const { return last_.has_value(); }
  /// ns; none: it may be silent for ever, as far as is known.
  std::optional<std::int64_t> longestSilence() const;
  /// It was heard once, and has been silent for longer than that.
  bool isOverdue(SteadyTime now) const;

 private:
  void measurePeriod();

  const std::int64_t given_ns_;
  std::optional<SteadyTime> last_;
  std::deque<std::int64_t> intervals_;  ///< ns, the latest
  std::optional<std::int64_t> period_ns_;
};

}  // namespace afterglow::replay

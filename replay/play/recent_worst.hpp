/// \file
/// The display of a figure that changes with every message.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <optional>

#include "replay/clock/steady_time.hpp"

namespace afterglow::replay {

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

}  // namespace afterglow::replay

#include "replay/play/lateness.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace afterglow::replay {

void Lateness::add(std::int64_t nanoseconds) {
  const std::int64_t late = std::max<std::int64_t>(0, nanoseconds);
  const std::size_t bin = late == 0
                              ? 0
                              : 1 + static_cast<std::size_t>(std::log2(static_cast<double>(late)) *
                                                             static_cast<double>(kBinsPerOctave));
  ++bins_[std::min(bin, bins_.size() - 1)];
  if (count_ < kEdge) {
    first_sum_ += late;
  }
  last_[count_ % kEdge] = late;
  max_ = std::max(max_, late);
  ++count_;
}

std::int64_t Lateness::quantile(double q) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    seen += bins_[bin];
    if (seen >= wanted && seen > 0) {
      const double edge = std::exp2(static_cast<double>(bin) / static_cast<double>(kBinsPerOctave));
      return bin == 0 ? 0 : std::min(max_, static_cast<std::int64_t>(edge));
    }
  }
  return max_;
}

double Lateness::drift() const {
  if (count_ == 0) {
    return 0;
  }
  const auto samples = static_cast<double>(std::min<std::uint64_t>(count_, kEdge));
  const std::int64_t last_sum = std::accumulate(last_.begin(), last_.end(), std::int64_t{0});
  return static_cast<double>(last_sum - first_sum_) / samples;
}

}  // namespace afterglow::replay

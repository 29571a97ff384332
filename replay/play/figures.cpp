#include "replay/play/figures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

namespace afterglow::replay {
namespace {

const Sample& farther(const Sample& a, const Sample& b) {
  return std::abs(b.value) > std::abs(a.value) ? b : a;
}

}  // namespace

void Samples::add(const Sample& sample) {
  const bool begins_group = count_++ % group_ == 0;
  if (!begins_group) {
    kept_.back() = farther(kept_.back(), sample);
    return;
  }
  if (kept_.size() == kMost) {
    for (std::size_t i = 0; i < kMost / 2; ++i) {
      kept_[i] = farther(kept_[2 * i], kept_[2 * i + 1]);
    }
    kept_.resize(kMost / 2);
    group_ *= 2;
  }
  kept_.push_back(sample);
}

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

namespace {

/// A base has a milestone every 20 ms; messages are measured by one of the last ones.
constexpr std::size_t kMostReached = 256;
/// The number of early samples; enough are measured of a replay that runs far ahead of its body.
constexpr std::size_t kMostEarly = 500;

}  // namespace

void Skew::begin(Stamp begin, SteadyTime start) {
  begin_ = begin;
  start_ = start;
}

void Skew::expect(Stamp milestone) { expected_.push_back(milestone); }

void Skew::reach(Stamp milestone, SteadyTime at) {
  const auto found = std::find(expected_.begin(), expected_.end(), milestone);
  if (found != expected_.end()) expected_.erase(found);
  reached_.push_back({milestone, at});
  if (reached_.size() > kMostReached) reached_.pop_front();
  early_.erase(std::remove_if(early_.begin(), early_.end(),
                              [this](const Sent& sent) { return measure(sent); }),
               early_.end());
}

void Skew::add(Modality modality, Stamp recorded, SteadyTime at, double rate) {
  const Sent sent{modality, recorded, at, rate};
  if (!measure(sent) && early_.size() < kMostEarly) early_.push_back(sent);
}

void Skew::restart() {
  expected_.clear();
  reached_.clear();
  early_.clear();
}

bool Skew::measure(const Sent& sent) {
  const Stamp latest{sent.recorded.ns + kMilestoneMarginNs};
  const Reached* last = nullptr;
  for (const Reached& reached : reached_) {
    if (reached.milestone <= latest && (!last || last->milestone <= reached.milestone)) {
      last = &reached;
    }
  }
  for (const Stamp expected : expected_) {
    if (expected <= latest && (!last || last->milestone < expected)) return false;
  }
  if (!last) return true;
  const double recorded_ns = static_cast<double>(sent.recorded.ns - last->milestone.ns) / sent.rate;
  const double skew_ns = static_cast<double>(sent.at.ns - last->at.ns) - recorded_ns;
  ModalitySkew& measured = measured_[sent.modality];
  const auto size_ns = static_cast<std::int64_t>(std::abs(skew_ns));
  measured.size.add(size_ns);
  recent_.add(std::max(sent.at, last->at), size_ns);
  measured.samples.add({static_cast<double>(sent.recorded.ns - begin_.ns) * 1e-9,
                        static_cast<double>(sent.at.ns - start_.ns) * 1e-9, skew_ns * 1e-6});
  return true;
}

}  // namespace afterglow::replay

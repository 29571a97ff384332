#include "replay/play/skew.hpp"

#include <algorithm>
#include <cstdlib>

namespace afterglow::replay {
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

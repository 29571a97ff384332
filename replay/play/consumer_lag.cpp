#include "replay/play/consumer_lag.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::replay {
namespace {

/// An answer to something older than so many messages counts as one to the oldest.
constexpr std::size_t kMostMoments = 10'000;

}  // namespace

ConsumerLag::ConsumerLag(double longest_s, Stamp begin, bool has_recorded_time)
    : longest_ns_(std::llround(longest_s * 1e9)),
      has_recorded_time_(has_recorded_time),
      published_(begin),
      answered_(begin) {}

void ConsumerLag::onPublished(Stamp recorded, Stamp ros_now) {
  if (recorded < published_) {
    moments_.clear();
    answered_ = recorded;
  }
  published_ = recorded;
  if (moments_.empty() || moments_.back().first < ros_now) {
    moments_.emplace_back(ros_now, recorded);
  }
  if (moments_.size() > kMostMoments) moments_.pop_front();
}

void ConsumerLag::onAnswer(Stamp header) {
  answered_ = has_recorded_time_ ? header : recordedAt(header);
}

Stamp ConsumerLag::recordedAt(Stamp ros) const {
  const auto after =
      std::upper_bound(moments_.begin(), moments_.end(), ros,
                       [](Stamp time, const auto& moment) { return time < moment.first; });
  if (after == moments_.end()) return published_;
  // A header is a little older than the message it came with.
  const Stamp recorded{after->second.ns - (after->first.ns - ros.ns)};
  return after == moments_.begin() ? recorded : std::max(std::prev(after)->second, recorded);
}

}  // namespace afterglow::replay

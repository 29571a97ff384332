#include "replay/play/samples.hpp"

#include <cmath>

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

}  // namespace afterglow::replay

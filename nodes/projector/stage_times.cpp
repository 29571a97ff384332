#include "nodes/projector/stage_times.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace afterglow::nodes {
namespace {

constexpr std::array<const char*, 8> kNames{"arrived",  "locked",  "converted", "scheduled",
                                            "composed", "blended", "drawn",     "published"};

/// The least of `sorted` that so large a part of them does not exceed.
float percentile(const std::vector<float>& sorted, std::size_t percent) {
  return sorted[(sorted.size() * percent + 99) / 100 - 1];
}

}  // namespace

void StageTimes::add(Stage stage, Duration time) {
  const float ms = std::chrono::duration<float, std::milli>(time).count();
  const std::lock_guard<std::mutex> lock(mutex_);
  Kept& kept = stages_[static_cast<std::size_t>(stage)];
  if (kept.ms.size() < kKept) return kept.ms.push_back(ms);
  kept.ms[kept.next] = ms;
  kept.next = (kept.next + 1) % kKept;
}

std::vector<std::pair<std::string, std::string>> StageTimes::words() const {
  std::vector<std::pair<std::string, std::string>> words;
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    std::vector<float> ms;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ms = stages_[i].ms;
    }
    if (ms.empty()) continue;
    std::sort(ms.begin(), ms.end());
    words.emplace_back(kNames[i], fmt::format("p50 {:.1f}, p99 {:.1f} ms", percentile(ms, 50),
                                              percentile(ms, 99)));
  }
  return words;
}

}  // namespace afterglow::nodes

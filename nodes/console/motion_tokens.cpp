#include "nodes/console/motion_tokens.hpp"

#include <algorithm>
#include <utility>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

void MotionTokens::forgetOld(Time now) {
  for (auto made = made_.begin(); made != made_.end();) {
    made = now - made->second.at >= kLifetime ? made_.erase(made) : std::next(made);
  }
}

std::string MotionTokens::make(Found found, Time now) {
  std::string token = replay::newKey();
  const std::lock_guard<std::mutex> lock(mutex_);
  forgetOld(now);
  if (made_.size() >= kMost) {
    made_.erase(std::min_element(made_.begin(), made_.end(), [](const auto& a, const auto& b) {
      return a.second.at < b.second.at;
    }));
  }
  made_[token] = {std::move(found), now};
  return token;
}

std::optional<MotionTokens::Found> MotionTokens::take(const std::string& token, Time now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  forgetOld(now);
  const auto made = made_.find(token);
  if (made == made_.end()) return std::nullopt;
  Found found = std::move(made->second.found);
  made_.erase(made);
  return found;
}

}  // namespace afterglow::nodes

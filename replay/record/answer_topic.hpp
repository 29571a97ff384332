/// \file
/// Where an action answers. Source: actionlib's five topics an action.
#pragma once

#include <algorithm>
#include <optional>
#include <string>

namespace afterglow::replay {

/// "/arm/result" for "/arm/goal"; empty for a topic that is no goal's.
inline std::optional<std::string> answerTopic(const std::string& topic) {
  const std::string ending = "/goal";
  const std::size_t size = topic.size() - std::min(topic.size(), ending.size());
  if (topic.substr(size) != ending) return std::nullopt;
  return topic.substr(0, size) + "/result";
}

}  // namespace afterglow::replay

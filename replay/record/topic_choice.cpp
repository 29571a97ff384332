#include "replay/record/topic_choice.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

std::vector<RegularExpression> compiled(const std::vector<std::string>& patterns) {
  std::vector<RegularExpression> made;
  for (const auto& pattern : patterns) made.push_back(RegularExpression::ofNames(pattern));
  return made;
}

/// `if_too_long`: the answer where an expression takes too long.
bool isMatched(const std::string& topic, const std::vector<RegularExpression>& patterns,
               bool if_too_long) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const RegularExpression& pattern) {
    try {
      return pattern.isWhole(topic);
    } catch (const RegularExpression::TooLong&) {
      return if_too_long;
    }
  });
}

bool isHousekeeping(const std::string& topic) {
  return topic == "/clock" || topic == "/rosout" || topic == "/rosout_agg";
}

}  // namespace

TopicChoice::TopicChoice(const std::vector<std::string>& regexes,
                         const std::vector<std::string>& exclude, bool all)
    : regexes_(compiled(regexes)), exclude_(compiled(exclude)), all_(all) {}

bool TopicChoice::matches(const std::string& topic) const {
  const bool is_taken = isMatched(topic, regexes_, false) || (all_ && !isHousekeeping(topic));
  return is_taken && !isMatched(topic, exclude_, true);
}

}  // namespace afterglow::replay

#include "replay/record/topic_choice.hpp"

#include <algorithm>
#include <stdexcept>

namespace afterglow::replay {
namespace {

std::vector<std::regex> compiled(const std::vector<std::string>& patterns) {
  std::vector<std::regex> made;
  for (const std::string& pattern : patterns) {
    try {
      made.emplace_back(pattern, std::regex::ECMAScript | std::regex::optimize);
    } catch (const std::regex_error& error) {
      throw std::invalid_argument("'" + pattern + "' is no regular expression: " + error.what());
    }
  }
  return made;
}

bool isMatched(const std::string& topic, const std::vector<std::regex>& patterns) {
  return std::any_of(patterns.begin(), patterns.end(),
                     [&](const std::regex& pattern) { return std::regex_match(topic, pattern); });
}

bool isHousekeeping(const std::string& topic) {
  return topic == "/clock" || topic == "/rosout" || topic == "/rosout_agg";
}

}  // namespace

TopicChoice::TopicChoice(const std::vector<std::string>& regexes,
                         const std::vector<std::string>& exclude, bool all)
    : regexes_(compiled(regexes)), exclude_(compiled(exclude)), all_(all) {}

bool TopicChoice::matches(const std::string& topic) const {
  const bool is_taken = isMatched(topic, regexes_) || (all_ && !isHousekeeping(topic));
  return is_taken && !isMatched(topic, exclude_);
}

}  // namespace afterglow::replay

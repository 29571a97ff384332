#include "replay/record/topic_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <vector>

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

namespace {

/// The number behind "key="; 0 if there is none.
double valueOf(const std::string& word, const std::string& key) {
  if (word.compare(0, key.size() + 1, key + "=") != 0) return 0;
  const char* begin = word.c_str() + key.size() + 1;
  char* end = nullptr;
  const double value = std::strtod(begin, &end);
  return *begin != '\0' && *end == '\0' && std::isfinite(value) && value > 0 ? value : 0;
}

bool isCount(double value) { return value >= 1 && value <= 1e9 && value == std::floor(value); }

}  // namespace

TopicLimit TopicLimit::parse(const std::string& text) {
  const auto refuse = [&text] {
    throw std::invalid_argument(
        "limit '" + text + "' is not of the form '/TOPIC every=COUNT' or '/TOPIC max_hz=RATE'");
  };
  std::istringstream words(text);
  TopicLimit limit;
  std::string word;
  words >> limit.topic;
  bool is_limited = false;
  while (words >> word) {
    const double every = valueOf(word, "every"), max_hz = valueOf(word, "max_hz");
    if (isCount(every)) {
      limit.every = static_cast<std::uint64_t>(every);
    } else if (every == 0 && max_hz >= 1e-6 && max_hz <= 1e6) {
      limit.max_hz = max_hz;
    } else {
      refuse();
    }
    is_limited = true;
  }
  if (limit.topic.empty() || limit.topic.front() != '/' || !is_limited) refuse();
  return limit;
}

std::string TopicLimit::str() const {
  std::vector<std::string> limits;
  if (every > 1) limits.push_back(fmt::format("every={}", every));
  if (max_hz > 0) limits.push_back(fmt::format("max_hz={:g}", max_hz));
  return fmt::format("{}", fmt::join(limits, " "));
}

bool TopicThinner::keeps(Stamp received) {
  const bool is_nth = seen_++ % limit_.every == 0;
  const bool keeps = is_nth && isDue(received);
  left_out_ += keeps ? 0 : 1;
  return keeps;
}

bool TopicThinner::isDue(Stamp received) {
  if (limit_.max_hz <= 0) return true;
  if (received < due_) return false;
  const auto period = static_cast<std::int64_t>(1e9 / limit_.max_hz);
  // The next one is due a period after this one was, unless the topic had fallen silent.
  due_ = {received.ns - due_.ns < period ? due_.ns + period : received.ns + period};
  return true;
}

}  // namespace afterglow::replay

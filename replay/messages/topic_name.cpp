#include "replay/messages/topic_name.hpp"

#include <algorithm>
#include <stdexcept>

#include "replay/messages/text.hpp"

namespace afterglow::replay {
namespace {

bool isOfNames(char letter) {
  return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') ||
         (letter >= '0' && letter <= '9') || letter == '_' || letter == '/';
}

/// Returns the name with one slash for several, none at the end.
std::string clean(std::string_view text) {
  std::string name;
  for (const char letter : text) {
    if (letter != '/' || name.empty() || name.back() != '/') name += letter;
  }
  if (name.size() > 1 && name.back() == '/') name.pop_back();
  return name;
}

/// Returns why ROS has no topic of that name, cleaned or not, one clause; empty: it may have.
std::string whyNone(std::string_view text) {
  if (text.empty() || text.front() != '/') return "it begins with no slash";
  const auto wrong = std::find_if_not(text.begin(), text.end(), isOfNames);
  if (wrong != text.end()) {
    const bool is_shown = *wrong > ' ' && *wrong <= '~';
    return (is_shown ? std::string("'") + *wrong + "'" : std::string("a letter in it")) +
           " is none of a-z, A-Z, 0-9, _ and /";
  }
  const std::string name = clean(text);
  if (name.size() < 2) return "a slash is no name";
  if (name.size() > TopicName::kLongest) {
    return "it has " + std::to_string(name.size()) + " letters, of " +
           std::to_string(TopicName::kLongest);
  }
  return "";
}

}  // namespace

TopicName::TopicName(const std::string& text) : text_(clean(text)) {
  if (const std::string why = whyNone(text); !why.empty()) {
    throw std::invalid_argument("'" + text.substr(0, kLongest) + "' is no topic: " + why);
  }
  if (text_ != text) {
    throw std::invalid_argument("'" + text.substr(0, kLongest) + "' is no clean name: '" +
                                text_ + "' is");
  }
}

std::optional<TopicName> TopicName::cleaned(std::string_view recorded) {
  if (!whyNone(recorded).empty()) return std::nullopt;
  return TopicName(clean(recorded));
}

TopicName TopicName::in(const std::string& name_space) const {
  if (name_space.empty() || name_space == "/") return *this;
  return {TopicName(name_space).text() + text_};
}

std::vector<TopicName> topicNames(const std::vector<std::string>& texts) {
  return {texts.begin(), texts.end()};
}

std::string actionOfGoal(const std::string& topic) {
  return endsWith(topic, "/goal") ? actionOf(topic) : "";
}

std::string actionOf(const std::string& topic) { return topic.substr(0, topic.rfind('/')); }

void checkNamespace(const std::string& text) {
  if (!text.empty()) (void)TopicName(text);
}

}  // namespace afterglow::replay

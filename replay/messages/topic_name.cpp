#include "replay/messages/topic_name.hpp"

#include <algorithm>
#include <initializer_list>
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

namespace {

bool isOneOf(const std::string& name, std::initializer_list<const char*> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool isShared(const std::string& topic) {
  return isOneOf(topic, {"/tf", "/tf_static", "/map", "/map_metadata", "/clock", "/rosout",
                         "/rosout_agg", "/diagnostics", "/diagnostics_agg"});
}

bool isIn(const std::string& name, const std::string& name_space) {
  return name.compare(0, name_space.size() + 1, name_space + "/") == 0;
}

std::string below(const std::string& prefix, const std::string& frame) {
  return prefix.empty() ? frame : prefix + "/" + frame;
}

}  // namespace

std::string RobotNames::topic(const std::string& usual) const {
  const bool stays = usual.empty() || name_space.empty() || isShared(usual) ||
                     isIn(usual, name_space);
  return stays ? usual : name_space + (usual.front() == '/' ? "" : "/") + usual;
}

std::string RobotNames::frame(const std::string& usual) const {
  const std::string name = bareName(usual);
  const bool stays = name.empty() || frame_prefix.empty() || isIn(name, frame_prefix) ||
                     isOneOf(name, {"map", "world", "earth"});
  return stays ? usual : below(frame_prefix, name);
}

std::string bareName(const std::string& name) {
  return !name.empty() && name.front() == '/' ? name.substr(1) : name;
}

std::string cleanNamespace(const std::string& text) {
  const std::size_t begin = text.find_first_not_of('/');
  if (begin == std::string::npos) return "";
  return "/" + text.substr(begin, text.find_last_not_of('/') - begin + 1);
}

RobotNames findRobotNames(const std::string& name_space, const std::string& said,
                          const std::function<bool(const std::string&)>& is_known) {
  const std::string name = bareName(name_space);
  const auto knows = [&](const std::string& prefix) {
    return is_known(below(prefix, "base_link")) || is_known(below(prefix, "base_footprint"));
  };
  const std::string asked = bareName(cleanNamespace(said));
  for (const std::string& prefix : {asked, name, name + "_tf"}) {
    if (!prefix.empty() && prefix != "_tf" && knows(prefix)) return {name_space, prefix};
  }
  return {name_space, knows("") ? "" : asked};
}

std::string RobotRenaming::topic(const std::string& name) const {
  if (recorded.name_space == live.name_space) return name;
  if (recorded.name_space.empty()) return live.topic(name);
  const bool is_own = isIn(name, recorded.name_space);
  return is_own ? live.name_space + name.substr(recorded.name_space.size()) : name;
}

std::string RobotRenaming::frame(const std::string& name) const {
  if (!renamesFrames()) return name;
  if (recorded.frame_prefix.empty()) return live.frame(name);
  const std::string own = bareName(name);
  if (!isIn(own, recorded.frame_prefix)) return name;
  return below(live.frame_prefix, own.substr(recorded.frame_prefix.size() + 1));
}

RobotRenaming renamingTo(const RobotNames& recorded, const std::string& name_space,
                         const std::string& said) {
  RobotRenaming renaming{recorded, {name_space, bareName(cleanNamespace(said))}};
  std::string& prefix = renaming.live.frame_prefix;
  const std::string then = bareName(recorded.name_space), now = bareName(name_space);
  if (then == now) {
    prefix = recorded.frame_prefix;
  } else if (prefix.empty()) {
    const bool is_called_so =
        !then.empty() && recorded.frame_prefix.compare(0, then.size(), then) == 0;
    const std::string rest = is_called_so ? recorded.frame_prefix.substr(then.size()) : "";
    prefix = !is_called_so ? recorded.frame_prefix : now.empty() ? "" : now + rest;
  }
  return renaming;
}

}  // namespace afterglow::replay

#include "replay/query/unknown_words.hpp"

#include <fmt/format.h>

#include <optional>
#include <set>

#include "replay/query/nearest.hpp"

namespace afterglow::replay {

std::string unknownWords(const Store& store, const BehaviorFilter& filter) {
  std::set<std::string> names, outcomes, topics, robots, tags;
  for (const Behavior& behavior : store.behaviors({})) {
    names.insert(behavior.name);
    outcomes.insert(behavior.outcome);
    robots.insert(behavior.robot);
    topics.insert(behavior.topics.begin(), behavior.topics.end());
    tags.insert(behavior.tags.begin(), behavior.tags.end());
  }
  std::string text;
  const auto tell = [&text](const char* what, const std::optional<std::string>& asked,
                            const std::set<std::string>& known) {
    if (!asked || known.count(*asked) > 0) return;
    text += fmt::format("{}none has the {} \"{}\"{}", text.empty() ? "" : "; ", what, *asked,
                        didYouMean(*asked, {known.begin(), known.end()}));
  };
  tell("name", filter.name, names);
  tell("outcome", filter.outcome, outcomes);
  tell("topic", filter.topic, topics);
  tell("robot", filter.robot, robots);
  tell("tag", filter.tag, tags);
  return text;
}

}  // namespace afterglow::replay

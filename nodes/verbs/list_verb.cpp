#include "nodes/verbs/list_verb.hpp"

#include <CLI/Error.hpp>
#include <iostream>
#include <memory>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/store/time_text.hpp"

namespace afterglow::nodes {
namespace {

struct Options {
  std::string store;
  std::optional<std::string> name, outcome, topic;
  std::string since, until;
  bool json = false;
};

std::optional<replay::Stamp> timeOption(const std::string& option, const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto stamp = replay::parseTime(text);
  if (!stamp) {
    throw CLI::ValidationError(option, "\"" + text +
                                           "\" is neither a time such as 2026-11-21T09:30:00 nor "
                                           "seconds since the epoch");
  }
  return stamp;
}

void printJson(const replay::Store& store, const std::vector<replay::Behavior>& behaviors) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& behavior : behaviors) {
    list.push_back(behaviorJson(behavior, store.topics(behavior)));
  }
  std::cout << dumpJson(list, 2) << "\n";
}

void printTable(const replay::Store& store, const std::vector<replay::Behavior>& behaviors) {
  using Align = TextTable::Align;
  TextTable table({{"ID", Align::Right},
                   {"BEGIN", Align::Left},
                   {"SECONDS", Align::Right},
                   {"MESSAGES", Align::Right},
                   {"OUTCOME", Align::Left},
                   {"NAME", Align::Left}});
  for (const auto& behavior : behaviors) {
    const auto topics = store.topics(behavior);
    std::uint64_t messages = 0;
    for (const auto& topic : topics) messages += topic.count;
    table.add({std::to_string(behavior.id), timeText(behavior.begin),
               fixedText(durationSeconds(behavior, topics), 1), std::to_string(messages),
               behavior.outcome.empty() ? "-" : behavior.outcome, behavior.name});
  }
  std::cout << table.text();
}

void runList(const Options& options) {
  replay::BehaviorFilter filter;
  filter.name = options.name;
  filter.outcome = options.outcome;
  filter.topic = options.topic;
  filter.since = timeOption("--since", options.since);
  filter.until = timeOption("--until", options.until);
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadOnly);
  const auto behaviors = store->behaviors(filter);
  if (options.json) {
    printJson(*store, behaviors);
  } else if (behaviors.empty()) {
    std::cerr << "no such behaviors in " << replay::storeUri(options.store) << "\n";
  } else {
    printTable(*store, behaviors);
  }
}

}  // namespace

void addListVerb(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* verb = app.add_subcommand("list", "List behaviors, newest first");
  verb->add_option("--name", options->name, "Only of this name");
  verb->add_option("--outcome", options->outcome, "Only with this outcome (success, failure, ...)");
  verb->add_option("--topic", options->topic, "Only with messages on this topic");
  verb->add_option("--since", options->since,
                   "Only what ended after this time: ISO 8601 (local without Z or +hh:mm) or "
                   "seconds since the epoch");
  verb->add_option("--until", options->until, "Only what began before this time");
  verb->add_flag("--json", options->json,
                 "As a JSON array of {id, name, tree_path, parent, attempt, outcome, begin_ns, "
                 "end_ns, robot, parameters, tags, topics: {topic: {type, count}}}");
  addStoreOption(*verb, options->store);
  verb->callback([options] { runList(*options); });
}

}  // namespace afterglow::nodes

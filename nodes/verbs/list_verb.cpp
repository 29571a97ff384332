#include "nodes/verbs/command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/query/filter.hpp"
#include "replay/query/time_text.hpp"
#include "replay/query/unknown_words.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

struct ListOptions {
  std::string store;
  replay::BehaviorFilter filter;  ///< filter as far as it stands in the command line
  std::optional<std::string> where;
  std::string since, until, before;
  bool last = false, explain = false, json = false;
};

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
               fmt::format("{:.1f}", durationSeconds(behavior, topics)), std::to_string(messages),
               behavior.outcome.empty() ? "-" : behavior.outcome, behavior.name});
  }
  std::cout << table.text();
}

/// Says that no behavior is found, and which words of the filter none has.
std::string noneFound(const replay::Store& store, const std::string& uri,
                      const replay::BehaviorFilter& filter) {
  replay::BehaviorFilter any;
  any.limit = 1;
  if (store.behaviors(any).empty()) return "no behaviors yet in " + uri;
  const std::string unknown = replay::unknownWords(store, filter);
  return "no such behaviors in " + uri + (unknown.empty() ? "" : "; " + unknown);
}

/// But for --before, which may name a behavior of the store.
replay::BehaviorFilter filterOf(const ListOptions& options) {
  replay::BehaviorFilter filter = options.filter;
  filter.since = timeOption("--since", options.since);
  filter.until = timeOption("--until", options.until);
  if (options.where) {
    filter.where = std::make_shared<const replay::Filter>(replay::Filter::parse(*options.where));
  }
  if (options.last) filter.limit = 1;
  return filter;
}

void runList(const ListOptions& options) {
  replay::BehaviorFilter filter = filterOf(options);
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadOnly);
  if (const auto before = momentOption(*store, options.store, options.before)) {
    filter.until = filter.until ? std::min(*filter.until, *before) : *before;
  }
  Waiting waiting("searching");
  if (options.explain) {
    for (const std::string& line : store->explain(filter)) std::cout << line << "\n";
    return;
  }
  const auto behaviors = store->behaviors(filter);
  if (options.json) {
    printJson(*store, behaviors);
  } else if (behaviors.empty()) {
    std::cerr << noneFound(*store, replay::storeUri(options.store), filter) << "\n";
  } else {
    printTable(*store, behaviors);
  }
}

}  // namespace

void addListVerb(CLI::App& app) {
  auto options = std::make_shared<ListOptions>();
  CLI::App* verb = addVerb(app, "list");
  verb->add_option("--name", options->filter.name, "Only of this name");
  verb->add_option("--outcome", options->filter.outcome,
                   "Only with this outcome (success, failure, ...)");
  verb->add_option("--topic", options->filter.topic, "Only with messages on this topic");
  verb->add_option("--robot", options->filter.robot, "Only of this robot");
  verb->add_option("--tag", options->filter.tag, "Only with this tag");
  verb->add_option("--where", options->where,
                   "Only what matches this filter, in MongoDB's language, over a behavior's fields "
                   "and, by topic, its messages': {\"attempt\": {\"$gt\": 1}, \"/cmd_vel\": "
                   "{\"linear.x\": {\"$gt\": 0.5}}}");
  verb->add_option("--since", options->since,
                   "Only what ended after this time: \"yesterday 14:00\", \"10 minutes ago\", ISO "
                   "8601 (local without Z or +hh:mm), seconds since the epoch");
  verb->add_option("--until", options->until, "Only what began before this time");
  verb->add_option("--before", options->before,
                   "Only what began before a behavior (\"3\", \"last failed pick\") or a time");
  CLI::Option* limit =
      verb->add_option("--limit", options->filter.limit, "Only so many, the newest");
  verb->add_flag("--last", options->last, "Only the newest")->excludes(limit);
  verb->add_flag("--explain", options->explain,
                 "How they are searched for, instead: by which index, how many messages are read");
  verb->add_flag("--json", options->json,
                 "As a JSON array of {id, name, tree_path, parent, attempt, outcome, begin_ns, "
                 "end_ns, robot, parameters, tags, topics: {topic: {type, count}}}; nanoseconds are "
                 "strings, as jq rounds such numbers");
  addStoreOption(*verb, options->store);
  verb->callback([options] { runList(*options); });
}

}  // namespace afterglow::nodes

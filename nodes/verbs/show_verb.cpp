#include "nodes/verbs/command.hpp"

#include <fmt/format.h>

#include <CLI/Error.hpp>
#include <algorithm>
#include <deque>
#include <filesystem>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <set>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/bags/bag_file.hpp"
#include "replay/messages/document.hpp"
#include "replay/query/filter.hpp"
#include "replay/query/time_text.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/behavior_edit.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::nodes {
namespace {

using replay::Behavior;
using replay::TopicSummary;

struct ShowOptions {
  std::vector<std::string> behavior;
  std::string store;
  bool json = false;
  bool messages = false;
  std::vector<std::string> topics;
  std::optional<std::string> where;
  std::uint64_t limit = std::numeric_limits<std::uint64_t>::max();
  std::optional<std::size_t> last;
};

// -------------------------------------------------------------------------------------------- JSON

nlohmann::ordered_json summariesJson(const std::vector<TopicSummary>& topics) {
  auto list = nlohmann::ordered_json::array();
  for (const TopicSummary& topic : topics) {
    nlohmann::ordered_json entry = {{"topic", topic.topic},       {"type", topic.type},
                                    {"count", topic.count},       {"hz", nullptr},
                                    {"first_ns", std::to_string(topic.first.ns)},
                                    {"last_ns", std::to_string(topic.last.ns)}};
    if (const auto hz = topic.rate_hz()) entry["hz"] = *hz;
    list.push_back(entry);
  }
  return list;
}

nlohmann::ordered_json nodesJson(const Behavior& behavior) {
  auto json = nlohmann::ordered_json::object();
  for (const auto& [topic, around] : recordedNodes(behavior)) {
    json[topic] = {{"publishers", around.publishers}, {"subscribers", around.subscribers}};
  }
  return json;
}

void printJson(const replay::Store& store, const Behavior& behavior) {
  const auto topics = store.topics(behavior);
  auto json = behaviorJson(behavior, topics);
  json["recording"] = behavior.recording;
  json["calibration"] = objectJson(behavior, "calibration", behavior.calibration);
  json["topic_names"] = behavior.topics;
  json["topic_details"] = summariesJson(topics);
  json["context_topics"] = summariesJson(store.contextTopics(behavior));
  json["nodes"] = nodesJson(behavior);
  json["notes"] = replay::notesOf(behavior);
  std::cout << dumpJson(json, 2) << "\n";
}

// -------------------------------------------------------------------------------------------- text

void printTopics(const std::string& title, replay::Stamp begin,
                 const std::vector<TopicSummary>& topics) {
  using Align = TextTable::Align;
  TextTable table({{title, Align::Left},
                   {"TYPE", Align::Left},
                   {"MESSAGES", Align::Right},
                   {"HZ", Align::Right},
                   {"FIRST", Align::Right},
                   {"LAST", Align::Right}});
  const auto offset = [&](replay::Stamp stamp) {
    return fmt::format("{:.3f} s", static_cast<double>(stamp.ns - begin.ns) * 1e-9);
  };
  for (const TopicSummary& topic : topics) {
    const auto hz = topic.rate_hz();
    table.add({topic.topic, topic.type, std::to_string(topic.count),
               hz ? fmt::format("{:.2f}", *hz) : "-",
               offset(topic.first), offset(topic.last)});
  }
  std::cout << "\n" << table.text("  ");
}

void printNodes(const Behavior& behavior) {
  using Align = TextTable::Align;
  const replay::RecordedNodes nodes = recordedNodes(behavior);
  if (nodes.empty()) return;
  TextTable table(
      {{"TOPIC", Align::Left}, {"PUBLISHED BY", Align::Left}, {"HEARD BY", Align::Left}});
  const auto list = [](const std::set<std::string>& names) {
    return names.empty() ? std::string("-") : fmt::format("{}", fmt::join(names, ", "));
  };
  for (const auto& [topic, around] : nodes) {
    table.add({topic, list(around.publishers), list(around.subscribers)});
  }
  std::cout << "\n" << table.text("  ");
}

std::vector<std::string> unheardTopics(const Behavior& behavior,
                                       const std::vector<TopicSummary>& topics) {
  std::vector<std::string> unheard;
  for (const std::string& name : behavior.topics) {
    const bool is_heard = std::any_of(topics.begin(), topics.end(),
                                      [&](const auto& topic) { return topic.topic == name; });
    if (!is_heard) unheard.push_back(name);
  }
  return unheard;
}

void printField(const std::string& name, const std::string& value) {
  if (value.empty() || value == "{}") return;
  std::cout << "  " << name << std::string(12 - name.size(), ' ') << value << "\n";
}

/// A line of a terminal has no room for a whole camera_info.
std::string beginningOf(const std::string& json) {
  constexpr std::size_t kRoom = 160, kShown = 120;
  if (json.size() <= kRoom) return json;
  return json.substr(0, kShown) + " ... (all of it: --json)";
}

void printText(const replay::Store& store, const Behavior& behavior) {
  const auto topics = store.topics(behavior);
  std::cout << "behavior " << behavior.id << " \"" << behavior.name << "\"\n";
  printField("tree path", behavior.tree_path);
  printField("parent", behavior.parent == 0 ? "" : std::to_string(behavior.parent));
  printField("attempt", std::to_string(behavior.attempt));
  printField("outcome", behavior.outcome);
  printField("begin", timeText(behavior.begin));
  printField("end", behavior.end ? timeText(*behavior.end) : "none: running, or cut off");
  printField("duration", fmt::format("{:.3f} s", durationSeconds(behavior, topics)));
  printField("robot", behavior.robot);
  printField("parameters", beginningOf(behavior.parameters));
  printField("tags", fmt::format("{}", fmt::join(behavior.tags, ", ")));
  for (const std::string& note : replay::notesOf(behavior)) printField("note", note);
  printField("calibration", beginningOf(behavior.calibration));
  printField("not heard", fmt::format("{}", fmt::join(unheardTopics(behavior, topics), ", ")));
  if (!topics.empty()) printTopics("TOPIC", behavior.begin, topics);
  const auto context = store.contextTopics(behavior);
  if (!context.empty()) printTopics("CONTEXT", behavior.begin, context);
  printNodes(behavior);
}

void printFile(const std::string& path) {
  replay::BagSummary bag;
  {
    Progress progress("reading " + path);
    bag = replay::summarizeBag(path, [&](auto done, auto total) { progress.update(done, total); });
  }
  for (const std::string& remark : bag.remarks) std::cerr << remark << "\n";
  std::cout << path << "\n";
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) {
    printField("size", sizeText(std::filesystem::file_size(path)));
  }
  printField("messages", std::to_string(bag.messages));
  if (bag.messages == 0) return;
  printField("begin", timeText(bag.first));
  printField("end", timeText(bag.last));
  printField("duration",
             fmt::format("{:.3f} s", static_cast<double>(bag.last.ns - bag.first.ns) * 1e-9));
  printTopics("TOPIC", bag.first, bag.topics);
}

// ---------------------------------------------------------------------------------------- messages

nlohmann::ordered_json messageJson(const replay::Message& message,
                                   replay::KnownChannels& channels) {
  const replay::Channel& channel = channels.channel(message.channel);
  nlohmann::ordered_json json = {{"topic", channel.topic},
                                 {"type", channel.type},
                                 {"received_ns", std::to_string(message.received.ns)},
                                 {"sequence", message.sequence},
                                 {"header_stamp_ns", nullptr},
                                 {"message", nullptr}};
  if (message.header_stamp) json["header_stamp_ns"] = std::to_string(message.header_stamp->ns);
  try {
    json["message"] =
        replay::toJson(replay::decode(channels.schema(message.channel), message.bytes));
  } catch (const replay::MessageError& error) {
    json["problem"] = error.what();
  }
  return json;
}

/// The last `count` that the cursor has.
std::deque<replay::Message> lastMessages(replay::MessageCursor& cursor, std::size_t count) {
  std::deque<replay::Message> last;
  while (auto message = cursor.next()) {
    last.push_back(std::move(*message));
    if (last.size() > count) last.pop_front();
  }
  return last;
}

void printMessages(const replay::Store& store, const Behavior& behavior,
                   const ShowOptions& options) {
  replay::MessageRange range;
  range.topics = options.topics;
  if (options.where) {
    range.where = std::make_shared<const replay::Filter>(
        replay::Filter::parse(*options.where, replay::Filter::Over::Messages));
  }
  const auto cursor = store.messages(behavior, range);
  replay::KnownChannels channels(store);
  const auto print = [&](const replay::Message& message) {
    std::cout << dumpJson(messageJson(message, channels)) << "\n";
  };
  if (options.last) {
    for (const auto& message : lastMessages(*cursor, *options.last)) print(message);
  } else {
    for (std::uint64_t i = 0; i < options.limit; ++i) {
      const auto message = cursor->next();
      if (!message) break;
      print(*message);
    }
  }
  tellOfDamage(cursor->damaged().size());
}

void runShow(const ShowOptions& options) {
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadOnly);
  const Behavior behavior = findBehavior(*store, options.store, options.behavior);
  if (options.messages) {
    printMessages(*store, behavior, options);
  } else if (options.json) {
    printJson(*store, behavior);
  } else {
    printText(*store, behavior);
  }
}

void runInfo(const ShowOptions& options) {
  if (options.behavior.size() == 1 && looksLikeFile(options.behavior.front())) {
    return printFile(options.behavior.front());
  }
  runShow(options);
}

}  // namespace

void addInfoVerb(CLI::App& app) {
  auto options = std::make_shared<ShowOptions>();
  CLI::App* verb = addVerb(app, "info");
  verb->add_option("what", options->behavior,
                   "FILE.bag, FILE.mcap, FILE.db3 or a ROS 2 bag's folder, read to its end; or a "
                   "behavior, as show has it")
      ->required();
  addStoreOption(*verb, options->store);
  verb->callback([options] { runInfo(*options); });
}

void addShowVerb(CLI::App& app) {
  auto options = std::make_shared<ShowOptions>();
  CLI::App* verb = addVerb(app, "show");
  verb->add_option("behavior", options->behavior, kBehaviorHelp)->required();
  CLI::Option* json = verb->add_flag("--json", options->json,
                                     "As JSON: list's object and recording, calibration, "
                                     "topic_names, topic_details, context_topics, nodes");
  CLI::Option* messages =
      verb->add_flag("--messages", options->messages,
                     "The decoded messages instead, one JSON object a line; long arrays shortened")
          ->excludes(json);
  verb->add_option("--topic", options->topics,
                   "Only messages on this topic, which may be a context topic; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->needs(messages);
  verb->add_option("--where", options->where,
                   "Only messages that match this filter, in MongoDB's language: {\"linear.x\": "
                   "{\"$gt\": 0.5}}; _meta.stamp_ns is when a message was received")
      ->needs(messages);
  CLI::Option* limit =
      verb->add_option("--limit", options->limit, "At most this many messages")->needs(messages);
  verb->add_option("--last", options->last, "At most this many messages, the last ones")
      ->needs(messages)
      ->excludes(limit);
  const auto refuse = [](const std::string&) {  // not in --help
    throw CLI::ValidationError("--html", "has become `afterglow render BEHAVIOR --out FILE.html`");
  };
  verb->add_option_function<std::string>("--html", refuse)->group("");
  addStoreOption(*verb, options->store);
  verb->callback([options] { runShow(*options); });
}

}  // namespace afterglow::nodes

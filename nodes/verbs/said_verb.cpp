#include "nodes/verbs/command.hpp"

#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <tuple>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/messages/document.hpp"
#include "replay/query/filter.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kSoundType = "sound_play/SoundRequest";

/// Sentences and files (sound -3 and -2), but not the order to stop one (command 0).
constexpr const char* kHeard = R"({"sound": {"$in": [-3, -2]}, "command": {"$ne": 0}})";

struct SaidOptions {
  std::string store, before, since;
  std::size_t limit = 10;
  bool json = false;
};

struct Utterance {
  replay::Stamp received;
  std::string text;
  bool is_sentence = true;  ///< else the name of a sound's file
  replay::Behavior behavior;
};

/// Utterances, the newest first; those of one time by their sequence.
using Key = std::tuple<std::int64_t, std::uint64_t, std::int64_t>;
using Utterances = std::map<Key, Utterance, std::greater<>>;

class Search {
 public:
  Search(const replay::Store& store, const SaidOptions& options)
      : store_(store),
        limit_(options.limit),
        before_(momentOption(store, options.store, options.before)),
        since_(timeOption("--since", options.since)),
        heard_(std::make_shared<const replay::Filter>(
            replay::Filter::parse(kHeard, replay::Filter::Over::Messages))) {}

  Utterances run() {
    replay::BehaviorFilter filter;
    filter.since = since_;
    filter.until = before_;
    for (const replay::Behavior& behavior : store_.behaviors(filter)) {
      if (!isTooOld(behavior)) listen(behavior);
    }
    return std::move(found_);
  }

 private:
  /// True if it ended before the last of those that are wanted.
  bool isTooOld(const replay::Behavior& behavior) const {
    return limit_ == 0 || (found_.size() >= limit_ && behavior.end &&
                           behavior.end->ns <= std::get<0>(found_.rbegin()->first));
  }

  void listen(const replay::Behavior& behavior) {
    replay::MessageRange range;
    std::set<std::string> topics;
    for (const auto& summaries : {store_.topics(behavior), store_.contextTopics(behavior)}) {
      for (const auto& summary : summaries) {
        if (summary.type == kSoundType) topics.insert(summary.topic);
      }
    }
    if (topics.empty()) return;
    range.topics.assign(topics.begin(), topics.end());
    range.end = before_;
    range.begin = since_;
    range.where = heard_;
    const auto cursor = store_.messages(behavior, range);
    while (const auto message = cursor->next()) add(behavior, *message);
  }

  void add(const replay::Behavior& behavior, const replay::Message& message) {
    const Key key(message.received.ns, message.sequence, behavior.recording);
    const auto known = found_.find(key);
    // Of behaviors within each other the inner one said it.
    if (known != found_.end() && known->second.behavior.begin >= behavior.begin) return;
    auto schema = schemas_.find(message.channel);
    if (schema == schemas_.end()) {
      const replay::Channel channel = store_.channel(message.channel);
      schema =
          schemas_.emplace(message.channel, replay::Schema::parse(channel.type, channel.definition))
              .first;
    }
    const auto document = replay::messageDocument(schema->second, message);
    found_[key] = {message.received, document.value("arg", ""), document.value("sound", 0) == -3,
                   behavior};
    if (found_.size() > limit_) found_.erase(std::prev(found_.end()));
  }

  const replay::Store& store_;
  const std::size_t limit_;
  const std::optional<replay::Stamp> before_, since_;
  const std::shared_ptr<const replay::Filter> heard_;
  std::map<std::int64_t, replay::Schema> schemas_;
  Utterances found_;
};

void printJson(const Utterances& utterances) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& [key, utterance] : utterances) {
    nlohmann::ordered_json entry = {{"received_ns", utterance.received.ns},
                                    {"text", nullptr},
                                    {"file", nullptr},
                                    {"behavior", utterance.behavior.id},
                                    {"name", utterance.behavior.name}};
    entry[utterance.is_sentence ? "text" : "file"] = utterance.text;
    list.push_back(std::move(entry));
  }
  std::cout << dumpJson(list, 2) << "\n";
}

void printTable(const Utterances& utterances) {
  using Align = TextTable::Align;
  TextTable table({{"TIME", Align::Left},
                   {"ID", Align::Right},
                   {"BEHAVIOR", Align::Left},
                   {"SAID", Align::Left}});
  for (const auto& [key, utterance] : utterances) {
    table.add({timeText(utterance.received), std::to_string(utterance.behavior.id),
               utterance.behavior.name,
               utterance.is_sentence ? "\"" + utterance.text + "\"" : "plays " + utterance.text});
  }
  std::cout << table.text();
}

void runSaid(const SaidOptions& options) {
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadOnly);
  Waiting waiting("listening");
  const Utterances utterances = Search(*store, options).run();
  if (options.json) {
    printJson(utterances);
  } else if (utterances.empty()) {
    std::cerr << "nothing was said in " << replay::storeUri(options.store) << "\n";
  } else {
    printTable(utterances);
  }
}

}  // namespace

void addSaidVerb(CLI::App& app) {
  auto options = std::make_shared<SaidOptions>();
  CLI::App* verb = addVerb(app, "said");
  verb->add_option("--before", options->before,
                   "Only before a behavior began (\"3\", \"last failed pick\") or before a time");
  verb->add_option("--since", options->since, "Only from this time on");
  verb->add_option("--limit", options->limit, "At most this many, the newest; default: 10");
  verb->add_flag("--json", options->json,
                 "As a JSON array of {received_ns, text, file, behavior, name}: text is null for a "
                 "sound's file, file for a sentence");
  addStoreOption(*verb, options->store);
  verb->callback([options] { runSaid(*options); });
}

}  // namespace afterglow::nodes

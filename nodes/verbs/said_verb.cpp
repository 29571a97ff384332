#include "nodes/verbs/command.hpp"

#include <iostream>
#include <map>
#include <memory>
#include <tuple>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/ask/said.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

struct SaidOptions {
  std::string store, before, since;
  std::size_t limit = 10;
  bool json = false;
};

struct Heard {
  replay::Utterance said;
  replay::Behavior behavior;
};

/// Utterances, the newest first; those of one time by their sequence.
using Key = std::tuple<std::int64_t, std::uint64_t, std::int64_t>;
using Utterances = std::map<Key, Heard, std::greater<>>;

class Search {
 public:
  Search(const replay::Store& store, const SaidOptions& options)
      : store_(store),
        limit_(options.limit),
        before_(momentOption(store, options.store, options.before)),
        since_(timeOption("--since", options.since)) {}

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
    range.end = before_;
    range.begin = since_;
    replay::hearUtterances(store_, behavior, range, [&](const replay::Utterance& said) {
      add(behavior, said);
      return true;
    });
  }

  void add(const replay::Behavior& behavior, const replay::Utterance& said) {
    const Key key(said.at.ns, said.sequence, behavior.recording);
    const auto known = found_.find(key);
    // Of behaviors within each other the inner one said it.
    if (known != found_.end() && known->second.behavior.begin >= behavior.begin) return;
    found_[key] = {said, behavior};
    if (found_.size() > limit_) found_.erase(std::prev(found_.end()));
  }

  const replay::Store& store_;
  const std::size_t limit_;
  const std::optional<replay::Stamp> before_, since_;
  Utterances found_;
};

void printJson(const Utterances& utterances) {
  auto list = nlohmann::ordered_json::array();
  for (const auto& [key, heard] : utterances) {
    nlohmann::ordered_json entry = {{"received_ns", std::to_string(heard.said.at.ns)},
                                    {"text", nullptr},
                                    {"file", nullptr},
                                    {"behavior", heard.behavior.id},
                                    {"name", heard.behavior.name}};
    entry[heard.said.is_sentence ? "text" : "file"] = heard.said.text;
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
  for (const auto& [key, heard] : utterances) {
    table.add({timeText(heard.said.at), std::to_string(heard.behavior.id),
               heard.behavior.name,
               heard.said.is_sentence ? "\"" + heard.said.text + "\"" : "plays " + heard.said.text});
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

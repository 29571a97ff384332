#include "nodes/verbs/command.hpp"

#include <fmt/format.h>

#include <CLI/Error.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "nodes/pages/page_numbers.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/messages/text.hpp"
#include "replay/query/filter.hpp"
#include "replay/query/time_text.hpp"
#include "replay/query/unknown_words.hpp"
#include "replay/store/behavior_edit.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/sqlite/store_care.hpp"
#include "replay/store/sync.hpp"

namespace afterglow::nodes {
namespace {

struct StoreOptions {
  std::string store;
  bool json = false;
  std::string older_than;
  std::optional<std::uint64_t> larger_than;
  std::vector<std::string> keep_tags;
  bool dry_run = false;
};

/// The file of a store that is one; a server keeps its own house.
std::string sqliteFile(const StoreOptions& options) {
  const std::string uri = replay::storeUri(options.store);
  if (uri.rfind("sqlite:", 0) != 0) {
    throw replay::StoreError(uri + ": only a store in a SQLite file is looked after this way");
  }
  return replay::storePath(uri);
}

/// Opens a store for writing. A wrong path is no reason to make a store.
std::unique_ptr<replay::Store> openExisting(const std::string& path) {
  if (!std::filesystem::exists(path)) {
    throw replay::StoreError("sqlite:" + path + ": no such store");
  }
  return replay::openStore(path, replay::OpenMode::ReadWrite);
}

// ------------------------------------------------------------------------------- check and repair

void runCheck(const StoreOptions& options) {
  const std::string path = sqliteFile(options);
  replay::StoreCheck check;
  {
    Progress progress("checking messages");
    check = replay::checkStore(
        path, [&](std::uint64_t done, std::uint64_t total) { progress.update(done, total); });
  }
  for (const std::string& problem : check.problems) std::cout << problem << "\n";
  if (check.dead_imports > 0) {
    std::cout << replay::counted(check.dead_imports, "import")
              << " did not come to an end; the next one, or \"afterglow store prune\", drops what "
                 "it left\n";
  }
  if (check.problems.empty()) {
    std::cout << "sqlite:" << path << ": " << replay::counted(check.messages, "message")
              << ", all is well\n";
    return;
  }
  throw replay::StoreError("sqlite:" + path + ": " +
                           replay::counted(check.problems.size(), "problem") +
                           "; \"afterglow store repair\" saves what can be read");
}

void runRepair(const StoreOptions& options) {
  const std::string path = sqliteFile(options);
  replay::StoreRepair repair;
  {
    Progress progress("saving messages");
    repair = replay::repairStore(
        path, [&](std::uint64_t done, std::uint64_t total) { progress.update(done, total); });
  }
  std::cout << "sqlite:" << path << ": " << replay::counted(repair.messages, "message")
            << " kept; the store as it was is now " << repair.damaged_path << "\n";
  for (const std::string& lost : repair.lost) std::cout << "lost: " << lost << "\n";
  if (!repair.lost.empty()) throw replay::StoreError("not everything could be saved");
}

// ---------------------------------------------------------------------------------- compact, prune

void runCompact(const StoreOptions& options) {
  const std::string path = sqliteFile(options);
  const auto size = [&] { return replay::storeStats(path).file_bytes; };
  const auto store = openExisting(path);
  const std::uint64_t before = size();
  {
    const Waiting waiting("compacting");
    store->compact();
  }
  std::cout << "sqlite:" << path << ": " << sizeText(before) << " before, " << sizeText(size())
            << " now\n";
}

replay::RetentionPolicy policyOf(const StoreOptions& options) {
  replay::RetentionPolicy policy;
  policy.most_bytes = options.larger_than;
  policy.keep_tags = options.keep_tags;
  if (!options.older_than.empty()) {
    policy.ended_before = replay::parseTime(options.older_than + " ago");
    if (!policy.ended_before) {
      throw CLI::ValidationError(
          "--older-than", "\"" + options.older_than + "\" is no time span such as 30d or 12h");
    }
  }
  if (!policy.ended_before && !policy.most_bytes) {
    throw CLI::ValidationError("prune", "needs --older-than or --larger-than, or both");
  }
  return policy;
}

void runPrune(const StoreOptions& options) {
  const std::string path = sqliteFile(options);
  const auto policy = policyOf(options);
  const auto print = [](const replay::Behavior& behavior) {
    std::cout << behavior.id << "  " << replay::timeText(behavior.begin) << "  " << behavior.name
              << "\n";
  };
  const auto store = openExisting(path);
  for (const std::string& tag : options.keep_tags) {
    replay::BehaviorFilter tagged;
    tagged.tag = tag;
    const std::string unknown = replay::unknownWords(*store, tagged);
    if (!unknown.empty()) std::cerr << "--keep-tag keeps nothing: " << unknown << "\n";
  }
  if (options.dry_run) {
    const auto gone = replay::pruneWould(*store, policy);
    for (const replay::Behavior& behavior : gone) print(behavior);
    std::cout << replay::counted(gone.size(), "behavior") << " would be removed\n";
    return;
  }
  const auto gone = replay::prune(*store, policy, print);
  std::cout << replay::counted(gone.size(), "behavior") << " removed\n";
  if (gone.empty()) return;
  if (replay::storeStats(path).recorder) {
    std::cout << "somebody records into it: the room is used for what comes\n";
  } else {
    const Waiting waiting("compacting");
    store->compact();
  }
}

// ------------------------------------------------------------------------------------------- stats

void printJson(const std::string& path, const replay::StoreStats& stats) {
  nlohmann::ordered_json json = {{"store", "sqlite:" + path},
                                 {"file_bytes", stats.file_bytes},
                                 {"free_bytes", stats.free_bytes},
                                 {"recordings", stats.recordings},
                                 {"behaviors", stats.behaviors},
                                 {"messages", stats.messages},
                                 {"files", stats.files},
                                 {"oldest_ns", nullptr},
                                 {"newest_ns", nullptr},
                                 {"recorder", nullptr},
                                 {"topics", nlohmann::ordered_json::array()},
                                 {"largest", nlohmann::ordered_json::array()}};
  if (stats.oldest) json["oldest_ns"] = std::to_string(stats.oldest->ns);
  if (stats.newest) json["newest_ns"] = std::to_string(stats.newest->ns);
  if (stats.recorder) json["recorder"] = *stats.recorder;
  for (const auto& topic : stats.topics) {
    json["topics"].push_back({{"topic", topic.topic},
                              {"type", topic.type},
                              {"messages", topic.messages},
                              {"bytes", topic.bytes}});
  }
  for (const auto& behavior : stats.largest) {
    json["largest"].push_back({{"id", behavior.id},
                               {"name", behavior.name},
                               {"begin_ns", std::to_string(behavior.begin.ns)},
                               {"messages", behavior.messages},
                               {"bytes", behavior.bytes}});
  }
  std::cout << dumpJson(json, 2) << "\n";
}

void printTables(const std::string& path, const replay::StoreStats& stats) {
  using Align = TextTable::Align;
  std::cout << "sqlite:" << path << "\n"
            << sizeText(stats.file_bytes) << ", " << sizeText(stats.free_bytes) << " of them free; "
            << replay::counted(stats.recordings, "recording") << ", "
            << replay::counted(stats.behaviors, "behavior") << ", "
            << replay::counted(stats.messages, "message") << ", "
            << replay::counted(stats.files, "file") << "\n";
  if (stats.oldest && stats.newest) {
    std::cout << "from " << replay::timeText(*stats.oldest) << " to "
              << replay::timeText(*stats.newest) << "\n";
  }
  if (stats.recorder) std::cout << *stats.recorder << " records into it\n";
  TextTable topics({{"MESSAGES", Align::Right},
                    {"SIZE", Align::Right},
                    {"TOPIC", Align::Left},
                    {"TYPE", Align::Left}});
  for (const auto& topic : stats.topics) {
    topics.add({std::to_string(topic.messages), sizeText(topic.bytes), topic.topic, topic.type});
  }
  TextTable largest({{"ID", Align::Right},
                     {"BEGIN", Align::Left},
                     {"MESSAGES", Align::Right},
                     {"SIZE", Align::Right},
                     {"NAME", Align::Left}});
  for (const auto& behavior : stats.largest) {
    largest.add({std::to_string(behavior.id), replay::timeText(behavior.begin),
                 std::to_string(behavior.messages), sizeText(behavior.bytes), behavior.name});
  }
  if (!stats.topics.empty()) std::cout << "\n" << topics.text();
  if (!stats.largest.empty()) std::cout << "\nlargest behaviors\n" << largest.text();
}

void runStats(const StoreOptions& options) {
  const std::string path = sqliteFile(options);
  std::optional<Waiting> waiting(std::in_place, "counting");
  const auto stats = replay::storeStats(path);
  waiting.reset();
  options.json ? printJson(path, stats) : printTables(path, stats);
}

CLI::App* addAction(CLI::App& verb, const std::string& name, const std::string& help,
                    const std::shared_ptr<StoreOptions>& options,
                    void (*run)(const StoreOptions&)) {
  CLI::App* action = verb.add_subcommand(name, help);
  addStoreOption(*action, options->store);
  action->callback([options, run] { run(*options); });
  return action;
}

}  // namespace

void addStoreVerb(CLI::App& app) {
  auto options = std::make_shared<StoreOptions>();
  CLI::App* verb = addVerb(app, "store");
  verb->require_subcommand(1);
  addAction(*verb, "check",
            "Read everything and compare its checksums; a line for each problem, and exit status 1 "
            "if there is one",
            options, runCheck);
  addAction(*verb, "repair",
            "Save what can be read of a damaged store into a new one; the damaged one is kept "
            "beside it. A line for all that is lost, and exit status 1 if something is",
            options, runRepair);
  addAction(*verb, "compact",
            "Give free space back to the disk, and make a store of an older version a current one",
            options, runCompact);
  CLI::App* stats = addAction(*verb, "stats", "What it holds, by topic, and its largest behaviors",
                              options, runStats);
  stats->add_flag("--json", options->json,
                  "As a JSON object {store, file_bytes, free_bytes, recordings, behaviors, "
                  "messages, files, oldest_ns, newest_ns, recorder, topics: [{topic, type, "
                  "messages, bytes}], largest: [{id, name, begin_ns, messages, bytes}]}");
  CLI::App* prune =
      addAction(*verb, "prune", "Remove old behaviors, oldest first", options, runPrune);
  prune->add_option("--older-than", options->older_than,
                    "Those that ended longer ago, for example 30d, 12h");
  prune
      ->add_option("--larger-than", options->larger_than,
                   "As many as it takes for the store to be no larger, for example 10G (2^30)")
      ->transform(CLI::AsSizeValue(false));
  prune->add_option("--keep-tag", options->keep_tags, "But none with this tag; may be repeated");
  prune->add_flag("--dry-run", options->dry_run, "Only say which");
}

namespace {

struct SyncOptions {
  std::string from, to, since, where;
  replay::BehaviorFilter filter;  ///< filter as far as it stands in the command line
};

replay::BehaviorFilter filterOf(const SyncOptions& options) {
  replay::BehaviorFilter filter = options.filter;
  filter.since = timeOption("--since", options.since);
  if (!options.where.empty()) {
    filter.where = std::make_shared<replay::Filter>(replay::Filter::parse(options.where));
  }
  return filter;
}

void runSync(const SyncOptions& options) {
  if (replay::storeUri(options.from) == replay::storeUri(options.to)) {
    throw CLI::ValidationError("--to", "is the store to copy from");
  }
  const replay::BehaviorFilter filter = filterOf(options);
  const auto from = replay::openStore(options.from, replay::OpenMode::ReadOnly);
  const auto to = replay::openStore(options.to, replay::OpenMode::ReadWrite);
  replay::SyncReport report;
  {
    Progress progress("copying behaviors");
    report = replay::syncBehaviors(
        *from, *to, filter,
        [&](std::size_t done, std::size_t all, const auto&) { progress.update(done, all); });
  }
  std::cout << report.copied << " behaviors copied (" << report.messages << " messages, "
            << report.files << " files), " << report.completed << " completed, " << report.present
            << " there already";
  if (report.open > 0) std::cout << ", " << report.open << " still running";
  if (report.damaged > 0) std::cout << "; " << report.damaged << " damaged messages left out";
  std::cout << ": " << replay::storeUri(options.from) << " to " << replay::storeUri(options.to)
            << "\n";
  if (report.copied + report.completed + report.present + report.open > 0) return;
  const std::string unknown = replay::unknownWords(*from, filter);
  if (!unknown.empty())
    std::cerr << "of " << replay::storeUri(options.from) << ", " << unknown << "\n";
}

}  // namespace

void addSyncVerb(CLI::App& app) {
  auto options = std::make_shared<SyncOptions>();
  CLI::App* verb = addVerb(app, "sync");
  verb->add_option("--from", options->from, "The store to copy from (PATH or mongodb://...)")
      ->required();
  verb->add_option("--to", options->to, "The store to copy to")->required();
  verb->add_option("--name", options->filter.name, "Only of this name");
  verb->add_option("--outcome", options->filter.outcome, "Only with this outcome");
  verb->add_option("--robot", options->filter.robot, "Only of this robot");
  verb->add_option("--tag", options->filter.tag, "Only with this tag");
  verb->add_option("--since", options->since, "Only what ended after this time");
  verb->add_option("--where", options->where, "Only what this filter matches (JSON)");
  verb->callback([options] { runSync(*options); });
}

}  // namespace afterglow::nodes

// The verbs of `afterglow` that need a store alone.
int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  return runCommand(argc, argv,
                    {addImportVerb, addInfoVerb, addListVerb, addShowVerb, addSaidVerb, addEditVerb,
                     addExportVerb, addStoreVerb, addSyncVerb});
}

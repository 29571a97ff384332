#include "nodes/verbs/command.hpp"

#include <CLI/Error.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/bags/bag_file.hpp"
#include "replay/store/mongo/roslog_import.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

struct ImportOptions {
  std::vector<std::string> sources;
  std::string store;
  std::string name;
  std::vector<std::string> tags;
  bool as_one = false;
  // Of a database.
  std::vector<std::string> topics;
  std::string since, until;
  std::optional<double> split_gap_s;
};

/// Takes away the files and folders of a store that was made for an import that then failed.
class NewStoreGuard {
 public:
  explicit NewStoreGuard(const std::string& store) {
    if (replay::isServerUri(replay::storeUri(store))) return;
    path_ = replay::storePath(store);
    std::error_code ignored;
    if (fs::exists(path_, ignored)) return;
    is_armed_ = true;
    for (fs::path folder = fs::absolute(path_, ignored).parent_path();
         !folder.empty() && !fs::exists(folder, ignored); folder = folder.parent_path()) {
      folders_.push_back(folder);
    }
  }
  NewStoreGuard(const NewStoreGuard&) = delete;
  NewStoreGuard& operator=(const NewStoreGuard&) = delete;
  ~NewStoreGuard() {
    if (!is_armed_) return;
    std::error_code ignored;
    for (const char* suffix : {"", "-wal", "-shm", "-journal", ".imports"}) {
      fs::remove(path_.string() + suffix, ignored);
    }
    for (const fs::path& folder : folders_) fs::remove(folder, ignored);
  }
  void disarm() { is_armed_ = false; }

 private:
  fs::path path_;
  bool is_armed_ = false;
  std::vector<fs::path> folders_;  ///< folders that were not there, innermost first
};

std::uint64_t countTopics(const std::vector<replay::TopicSummary>& summaries) {
  std::vector<std::string> names;
  for (const auto& summary : summaries) {
    if (names.empty() || names.back() != summary.topic) names.push_back(summary.topic);
  }
  return names.size();
}

void tell(const ImportOptions& options, const replay::Store& store,
          const replay::Behavior& behavior, std::uint64_t messages) {
  std::cout << messages << " messages on " << countTopics(store.topics(behavior))
            << " topics as behavior " << behavior.id << " \"" << behavior.name << "\" in "
            << replay::storeUri(options.store) << "\n";
}

void importBags(const ImportOptions& options, const std::vector<std::string>& paths,
                replay::Store& store) {
  replay::BagImportResult result;
  {
    Progress progress("importing");
    replay::BagImport import{options.name, options.tags, {}};
    import.progress = [&](auto done, auto total) { progress.update(done, total); };
    result = replay::importBags(paths, store, import);
  }
  for (const std::string& remark : result.remarks) std::cerr << remark << "\n";
  tell(options, store, result.behavior, result.messages);
}

std::uint64_t countMessages(const replay::Store& store, const replay::Behavior& behavior) {
  std::uint64_t count = 0;
  for (const auto& topic : store.topics(behavior)) count += topic.count;
  return count;
}

void importDatabase(const ImportOptions& options, replay::Store& store) {
  replay::RoslogImport import;
  import.name = options.name;
  import.tags = options.tags;
  import.topics = options.topics;
  import.since = timeOption("--since", options.since);
  import.until = timeOption("--until", options.until);
  if (options.split_gap_s) {
    import.split_gap_ns = static_cast<std::int64_t>(*options.split_gap_s * 1e9);
  }
  replay::RoslogImportResult result;
  {
    Progress progress("importing");
    import.progress = [&](auto done, auto total) { progress.update(done, total); };
    result = replay::importRoslog(options.sources.front(), store, import);
  }
  for (const std::string& remark : result.remarks) std::cerr << remark << "\n";
  for (const auto& behavior : result.behaviors) {
    tell(options, store, behavior, countMessages(store, behavior));
  }
}

/// ImportOptions of one kind of source do nothing for the other.
void checkSources(const ImportOptions& options) {
  const auto databases =
      std::count_if(options.sources.begin(), options.sources.end(), replay::isServerUri);
  if (databases > 0 && options.sources.size() > 1) {
    throw CLI::ValidationError("source", "a database is imported alone");
  }
  if (databases > 0 && options.as_one) {
    throw CLI::ValidationError("--as-one", "is for bags");
  }
  if (databases > 0 &&
      replay::storeUri(options.sources.front()) == replay::storeUri(options.store)) {
    throw CLI::ValidationError("source", "the database is the store itself");
  }
  const bool selects = !options.topics.empty() || !options.since.empty() ||
                       !options.until.empty() || options.split_gap_s;
  if (databases == 0 && selects) {
    throw CLI::ValidationError("--topic, --since, --until, --split-gap",
                               "are for a mongodb:// database");
  }
}

void runImport(const ImportOptions& options) {
  checkSources(options);
  NewStoreGuard guard(options.store);
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadWrite);
  if (replay::isServerUri(options.sources.front())) {
    importDatabase(options, *store);
  } else if (options.as_one) {
    importBags(options, options.sources, *store);
  } else {
    for (const std::string& path : options.sources) {
      importBags(options, {path}, *store);
      guard.disarm();
    }
  }
  guard.disarm();
}

}  // namespace

void addImportVerb(CLI::App& app) {
  auto options = std::make_shared<ImportOptions>();
  CLI::App* verb = addVerb(app, "import");
  verb->add_option("source", options->sources,
                   "FILE.bag, FILE.mcap, FILE.db3 or a ROS 2 bag's folder ..., or "
                   "mongodb://HOST[:PORT]/DATABASE as mongodb_log or the paper's action server "
                   "wrote it")
      ->required()
      ->expected(-1);
  verb->add_option("--name", options->name,
                   "Name of the behavior; default: the file's, without .bag, or the folder's or "
                   "database's");
  verb->add_option("--tag", options->tags, "A tag for the behavior; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  verb->add_flag("--as-one", options->as_one,
                 "The bags are parts of one recording: one behavior over all, in the order of "
                 "their stamps");
  verb->add_option("--topic", options->topics,
                   "Of a database: only these topics (comma between). Tells, too, which topic a "
                   "collection was that does not say so")
      ->delimiter(',');
  verb->add_option("--since", options->since, "Of a database: only what came then or later");
  verb->add_option("--until", options->until, "Of a database: only what came before");
  verb->add_option("--split-gap", options->split_gap_s,
                   "Of a database: another behavior after so many seconds without a message")
      ->check(CLI::PositiveNumber);
  addStoreOption(*verb, options->store);
  verb->callback([options] { runImport(*options); });
}

}  // namespace afterglow::nodes

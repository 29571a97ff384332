#include "nodes/verbs/import_verb.hpp"

#include <filesystem>
#include <iostream>
#include <memory>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/bags/bag_file.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string bag;
  std::string store;
  std::string name;
  std::vector<std::string> tags;
};

/// Takes away the files and folders of a store that was made for an import that then failed.
class NewStoreGuard {
 public:
  explicit NewStoreGuard(const std::string& path) : path_(path) {
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
    for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
      fs::remove(path_.string() + suffix, ignored);
    }
    for (const fs::path& folder : folders_) fs::remove(folder, ignored);
  }
  void disarm() { is_armed_ = false; }

 private:
  fs::path path_;
  bool is_armed_ = false;
  std::vector<fs::path> folders_;  ///< that were not there, innermost first
};

std::uint64_t countTopics(const std::vector<replay::TopicSummary>& summaries) {
  std::vector<std::string> names;
  for (const auto& summary : summaries) {
    if (names.empty() || names.back() != summary.topic) names.push_back(summary.topic);
  }
  return names.size();
}

replay::BagImportResult importWithProgress(const Options& options, replay::Store& store) {
  Progress progress("importing");
  replay::BagImport import{options.name, options.tags, {}};
  import.progress = [&](auto done, auto total) { progress.update(done, total);
};
return replay::importBag(options.bag, store, import);
}  // namespace

void runImport(const Options& options) {
  NewStoreGuard guard(replay::storePath(options.store));
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadWrite);
  const auto result = importWithProgress(options, *store);
  guard.disarm();
  if (result.unstamped > 0) {
    std::cerr << options.bag << ": left out " << result.unstamped
              << " messages whose stamp is zero, as rosbag does\n";
  }
  std::cout << result.messages << " messages on " << countTopics(store->topics(result.behavior))
            << " topics as behavior " << result.behavior.id << " \"" << result.behavior.name
            << "\" in " << replay::storeUri(options.store) << "\n";
}

}  // namespace afterglow::nodes

void addImportVerb(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* verb = app.add_subcommand("import", "Import a bag as one behavior");
  verb->add_option("bag", options->bag, "The bag, FILE.bag")->required();
  verb->add_option("--name", options->name,
                   "Name of the behavior; default: the file's, without .bag");
  verb->add_option("--tag", options->tags, "A tag for the behavior; may be repeated")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  addStoreOption(*verb, options->store);
  verb->callback([options] { runImport(*options); });
}

}  // namespace afterglow::nodes

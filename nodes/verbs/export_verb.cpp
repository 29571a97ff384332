#include "nodes/verbs/command.hpp"

#include <CLI/Error.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/bags/bag_file.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMegabyte = 1'000'000;

struct ExportOptions {
  std::vector<std::string> behaviors;
  std::string out;
  std::string store;
  std::vector<std::string> topics;
  bool with_context = false;
  bool is_ros2 = false;
  std::string format, compression;  ///< empty: as the file's name and the format have it
  std::optional<std::uint64_t> split_mb;
};

replay::RecordingFormat formatOf(const ExportOptions& options) {
  const std::string extension = fs::path(options.out).extension().string();
  if (options.format.empty() && extension == ".db3") {
    throw std::runtime_error(options.out + ": bags of ROS 2 are not written; FILE.bag and " +
                             "FILE.mcap are");
  }
  if (options.format.empty()) return replay::formatOfFile(options.out);
  return options.format == "mcap" ? replay::RecordingFormat::Mcap : replay::RecordingFormat::Rosbag;
}

replay::BagCompression compressionOf(const ExportOptions& options,
                                     replay::RecordingFormat format) {
  const bool is_mcap = format == replay::RecordingFormat::Mcap;
  if (options.compression == (is_mcap ? "bz2" : "zstd")) {
    throw CLI::ValidationError("--compression", options.compression + " is for " +
                                                    (is_mcap ? "bags" : "MCAP files"));
  }
  if (options.compression == "bz2") return replay::BagCompression::Bz2;
  if (options.compression == "zstd") return replay::BagCompression::Zstd;
  const bool is_default_lz4 = options.compression.empty() && is_mcap;
  if (options.compression == "lz4" || is_default_lz4) return replay::BagCompression::Lz4;
  return replay::BagCompression::None;
}

void requireMessages(const replay::Store& store, const replay::Behavior& behavior,
                     const std::vector<std::string>& topics) {
  replay::Behavior selection = behavior;
  if (!topics.empty()) selection.topics = topics;
  if (!store.topics(selection).empty()) return;
  std::string names;
  for (const std::string& topic : selection.topics) names += " " + topic;
  throw replay::StoreError("behavior " + std::to_string(behavior.id) +
                           " holds no messages on its topics:" + names);
}

std::string behaviorNames(const std::vector<replay::Behavior>& behaviors) {
  std::string names = behaviors.size() == 1 ? "behavior" : "behaviors";
  for (const auto& behavior : behaviors) {
    names += (&behavior == behaviors.data() ? " " : ", ") + std::to_string(behavior.id) + " \"" +
             behavior.name + "\"";
  }
  return names;
}

replay::BagExportResult exportWithProgress(const ExportOptions& options, const replay::Store& store,
                                           const std::vector<replay::Behavior>& behaviors) {
  replay::MessageRange range;
  range.topics = options.topics;
  range.with_all_topics = options.with_context;
  replay::BagExport bag;
  bag.format = formatOf(options);
  bag.is_ros2 = options.is_ros2;
  bag.compression = compressionOf(options, bag.format);
  if (options.split_mb) bag.split_bytes = *options.split_mb * kMegabyte;
  Progress progress("exporting");
  bag.progress = [&](auto done, auto total) { progress.update(done, total); };
  return replay::exportBags(store, behaviors, range, options.out, bag);
}

/// Ids and quoted words are a behavior each; other words are one together.
std::vector<std::vector<std::string>> selections(const std::vector<std::string>& arguments) {
  const auto stands_alone = [](const std::string& argument) {
    return argument.find(' ') != std::string::npos ||
           argument.find_first_not_of("0123456789") == std::string::npos;
  };
  if (!std::all_of(arguments.begin(), arguments.end(), stands_alone)) return {arguments};
  std::vector<std::vector<std::string>> each;
  for (const std::string& argument : arguments) each.push_back({argument});
  return each;
}

void runExport(const ExportOptions& options) {
  // What cannot be is refused before anything is read.
  compressionOf(options, formatOf(options));
  if (options.is_ros2 && formatOf(options) != replay::RecordingFormat::Mcap) {
    throw CLI::ValidationError("--ros2", "is for MCAP files");
  }
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadOnly);
  std::vector<replay::Behavior> behaviors;
  for (const auto& words : selections(options.behaviors)) {
    behaviors.push_back(findBehavior(*store, options.store, words));
    if (!options.with_context) requireMessages(*store, behaviors.back(), options.topics);
  }
  const auto result = exportWithProgress(options, *store, behaviors);
  std::cout << result.messages << " messages of " << behaviorNames(behaviors) << " in "
            << result.paths.front();
  if (result.paths.size() > 1) {
    std::cout << " to " << result.paths.back() << ", " << result.paths.size()
              << (formatOf(options) == replay::RecordingFormat::Mcap ? " files" : " bags");
  }
  std::cout << "\n";
  if (result.unstamped > 0) {
    std::cerr << "afterglow export: a bag cannot hold the stamp 0, which " << result.unstamped
              << (result.unstamped == 1 ? " message has" : " messages have")
              << ": it is 1 ns in it; --format mcap keeps it\n";
  }
  tellOfDamage(result.damaged);
}

}  // namespace

void addExportVerb(CLI::App& app) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* verb = addVerb(app, "export");
  verb->add_option("behavior", options->behaviors,
                   std::string(kBehaviorHelp) + "; several ids, or several such in quotes")
      ->required()
      ->expected(-1);
  verb->add_option("--out", options->out, "The bag or MCAP file to write; replaced when complete")
      ->required()
      ->expected(1);
  CLI::Option* topics =
      verb->add_option(
              "--topics", options->topics,
              "These topics (comma between) instead of the behavior's own; context topics such "
              "as /tf may be named")
          ->delimiter(',');
  verb->add_flag("--context", options->with_context,
                 "All that was recorded meanwhile, not the behavior's own topics alone")
      ->excludes(topics);
  verb->add_option("--format", options->format,
                   "bag (of ROS 1) or mcap (for Foxglove); default: as --out is named, else bag")
      ->check(CLI::IsMember({"bag", "mcap"}));
  verb->add_flag("--ros2", options->is_ros2,
                 "Messages as ROS 2 serializes them (mcap), for its `ros2 bag play`");
  verb->add_option("--compression", options->compression,
                   "none, lz4, bz2 (bag) or zstd (mcap); default: none in a bag, lz4 in an MCAP "
                   "file")
      ->check(CLI::IsMember({"none", "bz2", "lz4", "zstd"}));
  verb->add_option("--split-size", options->split_mb,
                   "Begin another bag after so many MB: F.bag becomes F_0.bag, F_1.bag, ...")
      ->check(CLI::PositiveNumber);
  addStoreOption(*verb, options->store);
  verb->callback([options] { runExport(*options); });
}

}  // namespace afterglow::nodes

#include "nodes/verbs/export_verb.hpp"

#include <iostream>
#include <memory>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/bags/bag_file.hpp"

namespace afterglow::nodes {
namespace {

struct Options {
  std::int64_t id = 0;
  std::string out;
  std::string store;
  std::vector<std::string> topics;
};

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

void runExport(const Options& options) {
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadOnly);
  const auto behavior = findBehavior(*store, options.store, options.id);
  requireMessages(*store, behavior, options.topics);
  replay::MessageRange range;
  range.topics = options.topics;
  std::uint64_t messages = 0;
  {
    Progress progress("exporting");
    messages = replay::exportBag(*store, behavior, range, options.out,
                                 [&](auto done, auto total) { progress.update(done, total); });
  }
  std::cout << messages << " messages of behavior " << behavior.id << " \"" << behavior.name
            << "\" in " << options.out << "\n";
}

}  // namespace

void addExportVerb(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* verb = app.add_subcommand("export", "Export a behavior as a bag");
  verb->add_option("id", options->id, "The behavior's id, as list prints it")->required();
  verb->add_option("--out", options->out, "The bag to write; replaced when complete")->required();
  verb->add_option(
          "--topics", options->topics,
          "These topics (comma between) instead of the behavior's own; context topics such "
          "as /tf may be named")
      ->delimiter(',');
  addStoreOption(*verb, options->store);
  verb->callback([options] { runExport(*options); });
}

}  // namespace afterglow::nodes

#include "nodes/verbs/command.hpp"

#include <CLI/Error.hpp>
#include <iostream>
#include <memory>
#include <optional>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/query/filter.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/sync.hpp"

namespace afterglow::nodes {
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

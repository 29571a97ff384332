#include <fmt/format.h>
#include <unistd.h>

#include <CLI/Error.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>

#include "nodes/verbs/command.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/behavior_edit.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

struct EditOptions {
  std::string store, trim;
  std::vector<std::string> behavior;
  replay::BehaviorEdit edit;
  bool is_delete = false, is_agreed = false;

  bool isChange() const {
    return edit.name || edit.outcome || !edit.add_tags.empty() || !edit.remove_tags.empty() ||
           !edit.notes.empty() || edit.isTrim();
  }
};

std::optional<std::int64_t> nanoseconds(const std::string& text) {
  if (text.empty()) return std::nullopt;
  std::size_t used = 0;
  double seconds = -1;
  try {
    seconds = std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used != text.size() || !(seconds >= 0 && seconds < 1e9)) {
    throw CLI::ValidationError("--trim", "\"" + text + "\" is no number of seconds");
  }
  return std::llround(seconds * 1e9);
}

void readTrim(EditOptions& options) {
  const auto colon = options.trim.find(':');
  if (colon == std::string::npos) {
    throw CLI::ValidationError("--trim", "has to be FROM:TO, one of which may be left out");
  }
  options.edit.from_ns = nanoseconds(options.trim.substr(0, colon));
  options.edit.to_ns = nanoseconds(options.trim.substr(colon + 1));
}

/// Throws unless it was said before, or somebody at a terminal says so now.
void requireYes(const EditOptions& options, const std::string& question) {
  if (options.is_agreed) return;
  if (isatty(STDIN_FILENO) == 0) throw std::runtime_error(question + " Say so with --yes");
  std::cerr << question << " [y/N] " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  if (answer != "y" && answer != "yes") throw std::runtime_error("nothing was changed");
}

/// Opens a store for writing. A wrong path is no reason to make a store.
std::unique_ptr<replay::Store> openForEdit(const std::string& uri) {
  const std::string name = replay::storeUri(uri);
  if (!replay::isServerUri(name) && !std::filesystem::exists(replay::storePath(uri))) {
    throw replay::StoreError(name + ": no such store");
  }
  return replay::openStore(uri, replay::OpenMode::ReadWrite);
}

void runEdit(EditOptions& options) {
  if (!options.trim.empty()) readTrim(options);
  if (options.is_delete == options.isChange()) {
    throw CLI::ValidationError("edit", options.is_delete ? "--delete goes without other changes"
                                                         : "no change is named");
  }
  const auto store = openForEdit(options.store);
  const replay::Behavior behavior = findBehavior(*store, options.store, options.behavior);
  replay::requireEnded(behavior);
  const std::string which = fmt::format("behavior {} '{}' of {}", behavior.id, behavior.name,
                                        replay::timeText(behavior.begin));
  if (options.is_delete) {
    requireYes(options, "Delete " + which + " and its messages for ever?");
    {
      const Waiting waiting("deleting");
      store->removeBehavior(behavior.id);
    }
    std::cout << "deleted " << which << "\n";
    return;
  }
  if (options.edit.isTrim()) {
    requireYes(options, "Delete what " + which + " holds outside of " + options.trim + " s?");
  }
  std::optional<Waiting> waiting(std::in_place, "changing");
  const replay::Behavior now = replay::editBehavior(*store, behavior.id, options.edit);
  waiting.reset();
  std::cout << "changed " << which << "; afterglow show " << now.id << " shows it\n";
}

}  // namespace

void addEditVerb(CLI::App& app) {
  auto options = std::make_shared<EditOptions>();
  CLI::App* verb = addVerb(app, "edit");
  replay::BehaviorEdit& edit = options->edit;
  verb->add_option("behavior", options->behavior, kBehaviorHelp)->required();
  addStoreOption(*verb, options->store);
  verb->add_option("--rename", edit.name, "Its name from now on");
  verb->add_option("--outcome", edit.outcome, "How it ended: success, failure, or any word");
  verb->add_option("--tag", edit.add_tags, "A word to find it by; may be repeated")
      ->expected(1)
      ->take_all();
  verb->add_option("--untag", edit.remove_tags, "A tag that it loses; may be repeated")
      ->expected(1)
      ->take_all();
  verb->add_option("--note", edit.notes, "A text that show prints; may be repeated")
      ->expected(1)
      ->take_all();
  verb->add_option("--trim", options->trim,
                   "FROM:TO, seconds since its begin: the part that stays, for example 2.5:10 or "
                   "2.5: ; messages outside that no other behavior covers are deleted");
  verb->add_flag("--delete", options->is_delete,
                 "Delete it, and the messages that no other behavior covers");
  verb->add_flag("--yes", options->is_agreed, "Do not ask before something is deleted");
  verb->callback([options] { runEdit(*options); });
}

}  // namespace afterglow::nodes

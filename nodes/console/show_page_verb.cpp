// `afterglow show --html`: a behavior as one self-contained page.
#include <CLI/App.hpp>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/console/behavior_detail.hpp"
#include "nodes/console/moment_images.hpp"
#include "nodes/console/picture_settings.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

struct ShowPageOptions {
  std::vector<std::string> behavior;
  std::string store, html;
  PictureOptions pictures;
};

void runShowPage(const ShowPageOptions& options) {
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadOnly);
  const replay::Behavior behavior = findBehavior(*store, options.store, options.behavior);
  BehaviorIndex index(*store);
  index.refresh();
  const auto detail = BehaviorDetails(*store, index).of(behavior.id);
  std::vector<MomentImage> images;
  if (const auto desk = openDesk(*store, options.pictures)) {
    images = keyImages(*detail, *desk);
  }
  std::ofstream file(options.html, std::ios::binary);
  file << behaviorPage(*detail, images);
  if (!file.flush()) throw std::runtime_error(options.html + ": cannot be written");
}

}  // namespace

void addShowPageVerb(CLI::App& app) {
  auto options = std::make_shared<ShowPageOptions>();
  CLI::App* verb = addVerb(app, "show");
  verb->add_option("behavior", options->behavior)->required();
  verb->add_option("--html", options->html)->required();
  addPictureOptions(*verb, options->pictures);
  addStoreOption(*verb, options->store);
  verb->callback([options] { runShowPage(*options); });
}

}  // namespace afterglow::nodes

// `afterglow show --html`: a behavior as one self-contained page.
#include <CLI/App.hpp>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/console/behavior_detail.hpp"
#include "nodes/console/moment_images.hpp"
#include "nodes/console/picture_settings.hpp"
#include "nodes/tools/program.hpp"
#include "nodes/tools/work_folder.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/terminal_text.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

struct ShowPageOptions {
  std::vector<std::string> behavior;
  std::string store, html;
  bool is_filmed = false;
  PictureOptions pictures;
};

/// As `afterglow render --film` makes it: an MP4 file's bytes.
std::string filmOf(const ShowPageOptions& options, std::int64_t behavior) {
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe");
  const WorkFolder work(options.html);
  const std::string film = work.path("film.mp4");
  std::vector<std::string> command{own.parent_path() / "afterglow_render", "render",
                                   std::to_string(behavior), "--film", "--out", film};
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) command.insert(command.end(), {name, value});
  };
  add("--store", options.store);
  add("--config", options.pictures.config);
  add("--calibration", options.pictures.calibration);
  add("--projector", options.pictures.projector);
  const ProgramResult result = runProgram(command);
  const auto end = result.output.find_last_not_of('\n') + 1;
  if (result.status != 0) {
    throw std::runtime_error("no film: " + oneLine(result.output.substr(0, end)));
  }
  std::ifstream file(film, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

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
  const std::string film = options.is_filmed ? filmOf(options, behavior.id) : "";
  std::ofstream file(options.html, std::ios::binary);
  file << behaviorPage(*detail, images, film);
  if (!file.flush()) throw std::runtime_error(options.html + ": cannot be written");
}

}  // namespace

void addShowPageVerb(CLI::App& app) {
  auto options = std::make_shared<ShowPageOptions>();
  CLI::App* verb = addVerb(app, "show");
  verb->add_option("behavior", options->behavior)->required();
  verb->add_option("--html", options->html)->required();
  verb->add_flag("--film", options->is_filmed);
  addPictureOptions(*verb, options->pictures);
  addStoreOption(*verb, options->store);
  verb->callback([options] { runShowPage(*options); });
}

}  // namespace afterglow::nodes

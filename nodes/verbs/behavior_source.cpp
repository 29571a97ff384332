#include "nodes/verbs/behavior_source.hpp"

#include "nodes/projector/recorded_scene.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/bags/bag_file.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

BehaviorSource openBag(const std::string& path) {
  BehaviorSource source;
  source.store = replay::openMemoryStore();
  Progress progress("reading the bag");
  replay::BagImport options;
  options.progress = [&progress](std::uint64_t done, std::uint64_t total) {
    progress.update(done, total);
  };
  source.behavior = replay::importBag(path, *source.store, options).behavior;
  source.name = path;
  return source;
}

}  // namespace

BehaviorSource openBehavior(const std::string& what, const std::string& store) {
  if (looksLikeFile(what)) return openBag(what);
  BehaviorSource source;
  source.store = replay::openStore(store, replay::OpenMode::ReadOnly);
  source.behavior = findBehavior(*source.store, store, {what});
  source.name =
      "behavior " + std::to_string(source.behavior.id) + " '" + source.behavior.name + "'";
  return source;
}

double secondsOf(const BehaviorSource& source) {
  const replay::Stamp end = endOf(*source.store, source.behavior);
  return static_cast<double>(end.ns - source.behavior.begin.ns) * 1e-9;
}

}  // namespace afterglow::nodes

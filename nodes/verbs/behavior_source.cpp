#include "nodes/verbs/behavior_source.hpp"

#include <charconv>
#include <cstdint>

#include "nodes/verbs/verb_tools.hpp"
#include "replay/bags/bag_file.hpp"

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
  std::int64_t id = 0;
  const char* end = what.data() + what.size();
  const auto [rest, error] = std::from_chars(what.data(), end, id);
  if (error != std::errc() || rest != end) return openBag(what);
  BehaviorSource source;
  source.store = replay::openStore(store, replay::OpenMode::ReadOnly);
  source.behavior = findBehavior(*source.store, store, id);
  source.name = "behavior " + std::to_string(id) + " '" + source.behavior.name + "'";
  return source;
}

}  // namespace afterglow::nodes

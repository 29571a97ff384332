// Whatever a client of the Foxglove WebSocket protocol sends: each line of an input is a frame,
// binary if it begins with a byte that no text begins with.
#include <algorithm>
#include <memory>
#include <string>

#include "nodes/console/foxglove_playback.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::fuzz::foxglove_fuzz {
namespace {

using namespace nodes;

std::unique_ptr<replay::Store> storeOfOneBehavior() {
  auto store = replay::openMemoryStore();
  const std::int64_t recording = store->beginImport({});
  const std::int64_t said = store->addChannel(recording, test::stringChannel("/said"));
  const std::int64_t kept = store->addChannel(recording, test::stringChannel("/kept", "/a", true));
  store->append(
      {test::stringMessage(said, 100, 1, "word"), test::stringMessage(kept, 200, 2, "map")});
  store->addBehavior(test::sampleBehavior(recording, {"/said", "/kept"}, 0, 700));
  store->finishImport(recording);
  return store;
}

}  // namespace

AFTERGLOW_FUZZ_TARGET(foxglove) {
  static const auto* const store = storeOfOneBehavior().release();
  static const replay::Behavior behavior = store->behavior(1).value();
  const auto frames = std::make_shared<FrameQueue>();
  FoxglovePlayback playback(*store, behavior, frames, {});
  const std::string text(reinterpret_cast<const char*>(data), size);
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    playback.take(
        {static_cast<unsigned char>(text[begin]) >= ' ', text.substr(begin, end - begin)});
    begin = end + 1;
  }
  while (frames->take()) {
  }
}

}  // namespace afterglow::fuzz::foxglove_fuzz

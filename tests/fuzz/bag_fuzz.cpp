// Bags, MCAP files and SQLite bags of ROS 2 from nowhere: an import ends with a BagError or with a
// behavior, and neither crashes, hangs nor reads beyond what it was given. Seeds: any small ones,
// packed with none, bz2, lz4 and zstd.
#include "replay/bags/bag_file.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/fuzz/target.hpp"

namespace afterglow::fuzz::bag_fuzz {

AFTERGLOW_FUZZ_TARGET(bag) {
  using namespace replay;
  // What each import leaves (a row for its recording) would fill the memory by and by.
  static auto store = openMemoryStore();
  static int inputs = 0;
  if (++inputs % 1000 == 0) store = openMemoryStore();
  const MemoryFile file(data, size);
  try {
    const auto imported = importBag(file.path(), *store);
    const auto cursor = store->messages(imported.behavior, {});
    while (cursor->next()) {
    }
    store->removeBehavior(imported.behavior.id);
  } catch (const BagError&) {
    // The right answer to most inputs.
  } catch (const StoreError&) {
    // A message or a text that no store takes.
  }
}

}  // namespace afterglow::fuzz::bag_fuzz

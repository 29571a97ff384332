// Bags from nowhere: an import ends with a BagError or with a behavior, and neither crashes, hangs
// nor reads beyond what it was given. Seeds: any small bags, packed with none, bz2 and lz4.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <string>

#include "replay/bags/bag_file.hpp"
#include "replay/store/open/open_store.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace afterglow::replay;
  static const auto store = openMemoryStore();
  const int file = memfd_create("bag", 0);
  if (file < 0 || write(file, data, size) != static_cast<ssize_t>(size)) return 0;
  try {
    const auto imported = importBag("/proc/self/fd/" + std::to_string(file), *store);
    const auto cursor = store->messages(imported.behavior, {});
    while (cursor->next()) {
    }
    store->removeBehavior(imported.behavior.id);
  } catch (const BagError&) {
    // The right answer to most inputs.
  }
  close(file);
  return 0;
}

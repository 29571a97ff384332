// A store's file that a disk or a hand has damaged. An input is a list of changes to a small store:
// two bytes that say where (little endian, in units of 4 bytes), and one that comes there.
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "replay/query/filter.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::fuzz::store_file_fuzz {
namespace {

using namespace replay;

std::vector<char> smallStore(const std::string& path) {
  {
    const auto store = openStore(path, OpenMode::ReadWrite);
    const std::int64_t recording = store->beginImport({});
    const std::int64_t channel = store->addChannel(recording, test::stringChannel("/said"));
    for (int i = 0; i < 8; ++i) {
      store->append({test::stringMessage(channel, i * 100, std::uint64_t(i), "word")});
    }
    store->addBehavior(test::sampleBehavior(recording, {"/said"}, 0, 700));
    store->finishImport(recording);
  }
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void readAll(const std::string& path) {
  const auto store = openStore(path, OpenMode::ReadOnly);
  for (const Behavior& behavior : store->behaviors({})) {
    test::readAll(*store->messages(behavior, {}));
  }
  BehaviorFilter filter;
  filter.name = "pick";
  store->behaviors(filter);
}

}  // namespace

AFTERGLOW_FUZZ_TARGET(store_file) {
  static const test::TempFolder folder;
  static const std::vector<char> whole = smallStore(folder.path("whole.db"));
  std::vector<char> damaged = whole;
  for (std::size_t i = 0; i + 2 < size; i += 3) {
    const std::size_t at = std::size_t(data[i] | data[i + 1] << 8) * 4;
    if (at < damaged.size()) damaged[at] = static_cast<char>(data[i + 2]);
  }
  const std::string path = folder.path("damaged.db");
  std::ofstream(path, std::ios::binary)
      .write(damaged.data(), static_cast<std::streamsize>(damaged.size()));
  try {
    readAll(path);
  } catch (const StoreError&) {
    // The right answer to most inputs.
  }
}

}  // namespace afterglow::fuzz::store_file_fuzz

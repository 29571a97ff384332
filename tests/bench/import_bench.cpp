// How fast bags are imported into a SQLite store on the disk of the temporary folder (TMPDIR):
// 400,000 small messages, as half an hour of joint states, odometry and commands has.
#include <benchmark/benchmark.h>

#include "replay/bags/bag_file.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay {
namespace {

using namespace afterglow::test;

constexpr std::uint64_t kMessages = 400'000;

void import(benchmark::State& state) {
  const TempFolder folder;
  const std::string bag = folder.path("large.bag");
  {
    const auto store = openStore(folder.path("from.db"), OpenMode::ReadWrite);
    const auto recording = store->addRecording({0, "", "bench", ""});
    const auto channel = store->addChannel(recording, stringChannel("/text"));
    std::vector<Message> batch;
    for (std::uint64_t i = 0; i < kMessages; ++i) {
      const auto stamp_ns = static_cast<std::int64_t>(1'000'000'000 + i * 1'000'000);
      batch.push_back(stringMessage(channel, stamp_ns, i, std::string(200, 'x')));
      if (batch.size() < 10'000) continue;
      store->append(batch);
      batch.clear();
    }
    const Behavior all = sampleBehavior(recording, {"/text"}, 0, std::int64_t{1} << 62);
    exportBags(*store, {all}, {}, bag);
  }
  int round = 0;
  for (auto _ : state) {
    const auto store =
        openStore(folder.path("to" + std::to_string(round++) + ".db"), OpenMode::ReadWrite);
    if (importBag(bag, *store).messages != kMessages) state.SkipWithError("not all were imported");
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kMessages));
}

BENCHMARK(import)->Name("import_bag_400k")->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace afterglow::replay

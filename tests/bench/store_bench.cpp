// How fast the store takes messages and gives them back: 1 KiB messages and clouds, in batches as
// the recorder makes them, on the disk of the temporary folder (TMPDIR).
#include <benchmark/benchmark.h>

#include "replay/store/store.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay {
namespace {

using namespace afterglow::test;

constexpr std::int64_t kForEver_ns = std::int64_t{1} << 62;

/// A PointCloud2-like message: a header and one large array.
Channel blobChannel() {
  return {"/blob",
          "bench/Blob",
          "00000000000000000000000000000001",
          "Header header\nuint8[] data\n"
          "================================================================================\n"
          "MSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n",
          false,
          "/bench"};
}

/// `size` bytes in all.
Bytes blobBytes(std::size_t size) {
  Bytes bytes(size, 7);
  const auto put = [&](std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
  };
  put(12, 0);  // an empty frame_id
  put(16, static_cast<std::uint32_t>(size - 20));
  return bytes;
}

std::vector<Message> makeBatch(std::int64_t channel, const Bytes& bytes, std::size_t count,
                               std::uint64_t& sequence) {
  std::vector<Message> batch;
  for (std::size_t i = 0; i < count; ++i, ++sequence) {
    batch.push_back({channel, Stamp{static_cast<std::int64_t>(sequence)}, sequence, {}, bytes});
  }
  return batch;
}

void report(benchmark::State& state, std::size_t messages, std::size_t size) {
  const auto count = static_cast<std::int64_t>(messages);
  state.SetItemsProcessed(state.iterations() * count);
  state.SetBytesProcessed(state.iterations() * count * static_cast<std::int64_t>(size));
}

/// Arguments: size of a message, messages in a batch.
void append(benchmark::State& state, const Channel& channel, const Bytes& bytes) {
  const TempFolder folder;
  const auto store = openStore(folder.path("store.db"), OpenMode::ReadWrite);
  const auto id = store->addChannel(store->addRecording({0, "", "bench", ""}), channel);
  const auto count = static_cast<std::size_t>(state.range(1));
  std::uint64_t sequence = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const auto batch = makeBatch(id, bytes, count, sequence);
    state.ResumeTiming();
    store->append(batch);
  }
  report(state, count, bytes.size());
}

void appendText(benchmark::State& state) {
  const auto size = static_cast<std::size_t>(state.range(0));
  append(state, stringChannel("/text"), stringBytes(std::string(size - 4, 'x')));
}

void appendBlob(benchmark::State& state) {
  append(state, blobChannel(), blobBytes(static_cast<std::size_t>(state.range(0))));
}

/// What of it is storing alone: bytes of a type that cannot be decoded.
void appendUndecoded(benchmark::State& state) {
  Channel channel = blobChannel();
  channel.definition = "unknown/Type data\n";
  append(state, channel, blobBytes(static_cast<std::size_t>(state.range(0))));
}

/// Arguments: size of a message, messages in all.
void readBack(benchmark::State& state) {
  const TempFolder folder;
  const auto store = openStore(folder.path("store.db"), OpenMode::ReadWrite);
  const auto recording = store->addRecording({0, "", "bench", ""});
  const auto id = store->addChannel(recording, blobChannel());
  const auto size = static_cast<std::size_t>(state.range(0));
  const auto count = static_cast<std::size_t>(state.range(1));
  std::uint64_t sequence = 0;
  while (sequence < count) store->append(makeBatch(id, blobBytes(size), count / 10, sequence));
  const Behavior behavior = sampleBehavior(recording, {"/blob"}, 0, kForEver_ns);
  for (auto _ : state) {
    std::size_t read = 0;
    const auto cursor = store->messages(behavior, {});
    while (const auto message = cursor->next()) read += message->bytes.size();
    if (read != size * count) state.SkipWithError("not all came back");
  }
  report(state, count, size);
}

BENCHMARK(appendText)->Args({100, 1000})->Args({1024, 100})->Args({1024, 1000})->UseRealTime();
BENCHMARK(appendBlob)
    ->Args({1024, 1000})
    ->Args({10 << 10, 1000})
    ->Args({1 << 20, 10})
    ->UseRealTime();
BENCHMARK(appendUndecoded)->Args({1024, 1000})->Args({1 << 20, 10})->UseRealTime();
BENCHMARK(readBack)->Args({1024, 100000})->Args({1 << 20, 200})->UseRealTime();

}  // namespace
}  // namespace afterglow::replay

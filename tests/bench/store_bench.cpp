// How fast the store takes messages, gives them back and finds behaviors, on the disk of the
// temporary folder (TMPDIR). Batches are what a recorder has after 100 ms at full speed; every
// batch is on disk (fsync) before the next one is begun.
#include <benchmark/benchmark.h>

#include "replay/store/open/open_store.hpp"
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

void append(benchmark::State& state, const std::vector<Channel>& channels,
            const std::vector<Bytes>& bytes, std::size_t count) {
  const TempFolder folder;
  const auto store = openStore(folder.path("store.db"), OpenMode::Record);
  const auto recording = store->addRecording({0, "", "bench", ""});
  Behavior behavior = sampleBehavior(recording, {}, 0, 0);
  behavior.end.reset();
  for (const Channel& channel : channels) behavior.topics.push_back(channel.topic);
  store->addBehavior(behavior);
  std::vector<std::int64_t> ids;
  for (const Channel& channel : channels) ids.push_back(store->addChannel(recording, channel));
  std::uint64_t sequence = 0;
  for (auto _ : state) {
    state.PauseTiming();
    auto batch = makeBatch(ids[0], bytes[0], count, sequence);
    for (std::size_t i = 0; i < count; ++i) {
      batch[i].channel = ids[i % ids.size()];
      batch[i].bytes = bytes[i % ids.size()];
    }
    state.ResumeTiming();
    store->append(batch);
  }
  report(state, count, bytes[0].size());
}

/// Text (std_msgs/String) and blobs in turn.
void append1KiB(benchmark::State& state) {
  append(state, {stringChannel("/text"), blobChannel()},
         {stringBytes(std::string(1020, 'x')), blobBytes(1024)}, 9000);
}

void append1MiB(benchmark::State& state) {
  append(state, {blobChannel()}, {blobBytes(1 << 20)}, 15);
}

void append100B(benchmark::State& state) {
  append(state, {stringChannel("/text")}, {stringBytes(std::string(96, 'x'))}, 9000);
}

/// A cloud of 1280 x 720 points: more than a chunk.
void append28MiB(benchmark::State& state) {
  append(state, {blobChannel()}, {blobBytes(28 << 20)}, 1);
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

// ------------------------------------------------------------ a million messages, 1,000 behaviors

/// Ten recordings of a hundred behaviors of ten seconds, one after the other, with twenty names;
/// one in ten failed. Each has 1,000 messages on ten topics and a snapshot as a recorder makes it.
class MillionMessages {
 public:
  MillionMessages() {
    const auto store = openStore(path(), OpenMode::ReadWrite);
    for (int recording = 0; recording < 10; ++recording) addRecording(*store);
  }
  std::string path() const { return folder_.path("store.db"); }

 private:
  void addRecording(Store& store) {
    const auto recording = store.addRecording({0, "", "/recorder", "fetch21"});
    std::vector<std::int64_t> channels;
    std::vector<std::string> topics;
    for (int i = 0; i < 10; ++i) {
      topics.push_back("/topic" + std::to_string(i));
      channels.push_back(store.addChannel(recording, stringChannel(topics.back())));
    }
    for (int i = 0; i < 100; ++i, ++behaviors_) {
      std::vector<Message> batch;
      Behavior behavior = sampleBehavior(recording, topics, now_ns_, now_ns_ + 10'000'000'000);
      for (std::uint64_t k = 0; k < 1000; ++k, now_ns_ += 10'000'000) {
        batch.push_back(stringMessage(channels[k % 10], now_ns_, sequence_++, text_));
      }
      behavior.name = "behavior " + std::to_string(behaviors_ % 20);
      behavior.outcome = behaviors_ % 10 == 3 ? "failure" : "success";
      behavior.snapshot = "{\"frames\": \"" + std::string(3000, 'x') + "\"}";
      store.append(batch);
      store.addBehavior(behavior);
    }
  }

  TempFolder folder_;
  const std::string text_ = std::string(100, 'x');
  std::int64_t now_ns_ = 1'700'000'000'000'000'000;
  std::uint64_t sequence_ = 0;
  int behaviors_ = 0;
};

std::string millionMessages() {
  static const MillionMessages store;  // made once for all
  return store.path();
}

/// Opens the store and finds as `afterglow list` does, with the counts.
void listBehaviors(benchmark::State& state, const BehaviorFilter& filter, std::size_t expected) {
  const std::string path = millionMessages();
  for (auto _ : state) {
    const auto store = openStore(path, OpenMode::ReadOnly);
    const auto behaviors = store->behaviors(filter);
    std::uint64_t messages = 0;
    for (const Behavior& behavior : behaviors) {
      for (const auto& topic : store->topics(behavior)) messages += topic.count;
    }
    if (messages != expected * 1000) state.SkipWithError("not all were found");
  }
}

void listByName(benchmark::State& state) {
  BehaviorFilter filter;
  filter.name = "behavior 7";
  listBehaviors(state, filter, 50);
}

void listByOutcome(benchmark::State& state) {
  BehaviorFilter filter;
  filter.outcome = "failure";
  listBehaviors(state, filter, 100);
}

void listAll(benchmark::State& state) { listBehaviors(state, {}, 1000); }

/// Opens the store, finds the behavior and has its first message.
void firstMessage(benchmark::State& state) {
  const std::string path = millionMessages();
  std::int64_t id = 0;
  for (auto _ : state) {
    const auto store = openStore(path, OpenMode::ReadOnly);
    const auto behavior = store->behavior(1 + id++ % 1000);
    if (!store->messages(*behavior, {})->next()) state.SkipWithError("no message");
  }
}

BENCHMARK(append1KiB)->Name("sqlite_append_1KiB")->MinTime(3)->UseRealTime();
BENCHMARK(append1MiB)->Name("sqlite_append_1MiB")->MinTime(3)->UseRealTime();
BENCHMARK(append100B)->Name("sqlite_append_100B")->UseRealTime();
BENCHMARK(append28MiB)->Name("sqlite_append_28MiB")->UseRealTime();
BENCHMARK(readBack)->Args({1024, 100000})->Args({1 << 20, 200})->UseRealTime();
BENCHMARK(listByName)->Name("list_by_name_1M")->Unit(benchmark::kMillisecond);
BENCHMARK(listByOutcome)->Name("list_by_outcome_1M")->Unit(benchmark::kMillisecond);
BENCHMARK(listAll)->Name("list_all_1M")->Unit(benchmark::kMillisecond);
BENCHMARK(firstMessage)->Name("first_message_1M")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace afterglow::replay

// What the MongoDB store costs, beside store_bench's figures for SQLite.
//   mongo_bench mongodb://HOST/ [MESSAGES [BEHAVIORS]]     writes into a new database there
// Where there is no mongod: tests/mongodb/server run FOLDER PORT DATA. FerretDB scans where MongoDB
// has an index: its figures say what this program does, not what a MongoDB server can do.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

#include "replay/query/filter.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/store.hpp"
#include "tests/support/store_samples.hpp"

namespace {

using namespace afterglow;
using namespace afterglow::replay;

double secondsOf(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void fill(Store& store, std::int64_t messages, std::int64_t behaviors) {
  const std::int64_t recording = store.addRecording({0, "", "bench", "fetch7"});
  const std::int64_t channel = store.addChannel(recording, test::stringChannel("/said"));
  constexpr std::int64_t kBatch = 1000;
  const double seconds = secondsOf([&] {
    for (std::int64_t begin = 0; begin < messages; begin += kBatch) {
      std::vector<Message> batch;
      for (std::int64_t i = begin; i < std::min(begin + kBatch, messages); ++i) {
        batch.push_back(test::stringMessage(channel, i * 1'000'000, static_cast<std::uint64_t>(i),
                                            std::to_string(i) + std::string(1000, ' ')));
      }
      store.append(batch);
    }
  });
  std::printf("append of 1 KiB: %.0f messages/s\n", static_cast<double>(messages) / seconds);
  const std::int64_t span_ns = messages * 1'000'000 / behaviors;
  for (std::int64_t i = 0; i < behaviors; ++i) {
    Behavior behavior = test::sampleBehavior(recording, {"/said"}, i * span_ns, (i + 1) * span_ns);
    behavior.name = i % 10 == 0 ? "pick" : "drive";
    behavior.outcome = i % 3 == 0 ? "failure" : "success";
    store.addBehavior(behavior);
  }
}

void ask(const Store& store, std::int64_t messages) {
  BehaviorFilter filter;
  filter.name = "pick";
  filter.outcome = "failure";
  std::size_t found = 0;
  double seconds = secondsOf([&] { found = store.behaviors(filter).size(); });
  std::printf("list by name and outcome: %.2f ms (%zu)\n", seconds * 1e3, found);
  filter = {};
  const std::string wanted = std::to_string(messages / 2);
  filter.where = std::make_shared<Filter>(
      Filter::parse(R"({"/said": {"data": {"$regex": "^)" + wanted + " \"}}}"));
  filter.limit = 1;
  seconds = secondsOf([&] { found = store.behaviors(filter).size(); });
  std::printf("where on a message field: %.2f ms (%zu)\n", seconds * 1e3, found);
  const Behavior newest = store.behaviors({}).front();
  seconds = secondsOf([&] { store.messages(newest, {})->next(); });
  std::printf("first message of a behavior: %.2f ms\n", seconds * 1e3);
  seconds = secondsOf([&] { found = test::readAll(*store.messages(newest, {})).size(); });
  std::printf("all %zu messages of a behavior: %.2f ms\n", found, seconds * 1e3);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: mongo_bench mongodb://HOST/ [MESSAGES [BEHAVIORS]]\n");
    return 2;
  }
  const std::int64_t messages = argc > 2 ? std::atoll(argv[2]) : 5'000;
  const std::int64_t behaviors = argc > 3 ? std::atoll(argv[3]) : 50;
  const std::string uri = std::string(argv[1]) + "bench_" + newKey();
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  try {
    const auto store = openStore(uri, OpenMode::ReadWrite);
    fill(*store, messages, behaviors);
    ask(*store, messages);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "mongo_bench: %s\n", error.what());
    return 1;
  }
}

// How fast behaviors are found by what was in their messages: 1,000 behaviors, 1,000,000 messages.
#include <benchmark/benchmark.h>

#include <cstring>

#include "replay/query/filter.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/query_cases.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay {
namespace {

using namespace afterglow::test;

constexpr std::int64_t kBehaviors = 1000, kSpeeds = 800, kWords = 200;

/// The speed is a little different in every message; in each hundredth behavior it goes beyond 0.9.
Bytes speedBytes(std::int64_t behavior, std::int64_t i) {
  const double top = behavior % 100 == 50 ? 0.95 : 0.5 + 0.0003 * static_cast<double>(behavior);
  const double x = top * static_cast<double>(i + 1) / static_cast<double>(kSpeeds);
  const double z = static_cast<double>(behavior * kSpeeds + i * 7919 % kSpeeds) / 1e6;
  Bytes bytes(48, 0);
  std::memcpy(bytes.data(), &x, sizeof(x));
  std::memcpy(bytes.data() + 40, &z, sizeof(z));
  return bytes;
}

/// A store on disk, closed and opened again, as `afterglow list` finds it.
class MillionMessages {
 public:
  MillionMessages() {
    auto store = openStore(folder_.path("store.db"), OpenMode::ReadWrite);
    const auto recording = store->addRecording({0, "", "bench", "fetch7"});
    const auto speed = store->addChannel(recording, twistChannelAt("/cmd_vel"));
    const auto said = store->addChannel(recording, stringChannel("/said"));
    std::int64_t now = 0;
    for (std::int64_t n = 0; n < kBehaviors; ++n) {
      Behavior behavior = sampleBehavior(recording, {"/cmd_vel", "/said"}, now, now);
      behavior.end.reset();
      behavior.name = n % 3 == 0 ? "pick" : n % 3 == 1 ? "place" : "drive";
      const auto id = store->addBehavior(behavior);
      std::vector<Message> messages;
      for (std::int64_t i = 0; i < kSpeeds + kWords; ++i, ++now) {
        const bool is_word = i % 5 == 4;
        const std::string word = "object " + std::to_string(n * kWords + i / 5) + " seen";
        messages.push_back({is_word ? said : speed, Stamp{now}, static_cast<std::uint64_t>(now),
                            std::nullopt, is_word ? stringBytes(word) : speedBytes(n, i - i / 5)});
      }
      store->append(messages);
      endBehavior(*store, id, Stamp{now}, n % 10 == 0 ? "failure" : "success");
    }
    store.reset();
    store_ = openStore(folder_.path("store.db"), OpenMode::ReadOnly);
  }
  const Store& store() const { return *store_; }

 private:
  TempFolder folder_;
  std::unique_ptr<Store> store_;
};

void find(benchmark::State& state, const std::string& filter, std::size_t expected) {
  static const MillionMessages million;
  BehaviorFilter asked;
  asked.where = std::make_shared<const Filter>(Filter::parse(filter));
  for (auto _ : state) {
    if (million.store().behaviors(asked).size() != expected) {
      state.SkipWithError("found too many or too few");
    }
  }
  std::string how;
  for (const std::string& line : million.store().explain(asked)) how += "; " + line;
  state.SetLabel(how.substr(2));
}

BENCHMARK_CAPTURE(find, name_and_outcome_1M, R"({"name": "pick", "outcome": "failure"})", 34)
    ->Name("list_name_outcome_1M")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(find, range, R"({"/cmd_vel": {"linear.x": {"$gt": 0.9}}})", 10)
    ->Name("where_range_1M")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(find, equal, R"({"/cmd_vel": {"angular.z": 0.123456}})", 1)
    ->Name("where_equal_rare_1M")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(find, string, R"({"/said": {"data": "object 123456 seen"}})", 1)
    ->Name("where_string_1M")
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(find, absent, R"({"/cmd_vel": {"linear.x": 0.1234567891}})", 0)
    ->Name("where_absent_1M")
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace afterglow::replay

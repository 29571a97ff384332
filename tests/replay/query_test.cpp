// Queries through a SQLite store; store_suite_test asks both stores.
#include <gtest/gtest.h>

#include <random>

#include "replay/query/filter.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/query_cases.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::query_test {
namespace {

using namespace afterglow::test;
using Names = std::vector<std::string>;

BehaviorFilter where(const std::string& filter) {
  BehaviorFilter asked;
  asked.where = std::make_shared<const Filter>(Filter::parse(filter));
  return asked;
}

Names namesOf(const std::vector<Behavior>& behaviors) {
  Names names;
  for (const Behavior& behavior : behaviors) names.push_back(behavior.name);
  return names;
}

Names ask(const Store& store, const std::string& filter) {
  return namesOf(store.behaviors(where(filter)));
}

void expectAllCases(const Store& store) {
  for (const QueryCase& c : queryCases()) EXPECT_EQ(ask(store, c.filter), c.names) << c.filter;
  const Behavior blue = store.behaviors(where(R"({"name": "pick blue"})")).at(0);
  for (const MessageCase& c : messageCases()) {
    MessageRange range;
    range.topics = {c.topic};
    range.where = std::make_shared<const Filter>(Filter::parse(c.filter, Filter::Over::Messages));
    EXPECT_EQ(readAll(*store.messages(blue, range)).size(), c.count) << c.filter;
  }
}

TEST(Query, findsWhatItShouldInAStoreThatIsWrittenTo) {
  const auto store = openMemoryStore();
  fillQueryStore(*store);
  expectAllCases(*store);
}

TEST(Query, findsTheSameInAStoreThatIsClosedAndOneWhoseRecorderDied) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  auto store = openStore(path, OpenMode::ReadWrite);
  fillQueryStore(*store);
  expectAllCases(*openStore(path, OpenMode::ReadOnly));
  store.reset();
  expectAllCases(*openStore(path, OpenMode::ReadOnly));
}

TEST(Query, givesTheNewestThatMatch) {
  const auto store = openMemoryStore();
  fillQueryStore(*store);
  BehaviorFilter filter = where(R"({"/said": {"data": "done"}})");
  filter.limit = 1;
  EXPECT_EQ(namesOf(store->behaviors(filter)), Names{"place"});
  filter.limit = 0;
  EXPECT_TRUE(store->behaviors(filter).empty());
}

/// Behaviors of 1000 messages each, of which number n counts up from 1000 n.
std::unique_ptr<Store> countingStore(std::int64_t behaviors,
                                     std::unique_ptr<Store> store = openMemoryStore()) {
  const auto recording = store->addRecording({0, "", "test", ""});
  const auto channel = store->addChannel(
      recording, {"/count", "std_msgs/Int32", std::string(32, '1'), "int32 data\n", false, ""});
  for (std::int64_t n = 0; n < behaviors; ++n) {
    Behavior behavior = sampleBehavior(recording, {"/count"}, n * 1000, n * 1000 + 1000);
    behavior.name = std::to_string(n);
    store->addBehavior(behavior);
    std::vector<Message> messages;
    for (std::int64_t i = n * 1000; i < n * 1000 + 1000; ++i) {
      Bytes bytes(4);
      const auto value = static_cast<std::int32_t>(i);
      std::memcpy(bytes.data(), &value, sizeof(value));
      messages.push_back({channel, Stamp{i}, static_cast<std::uint64_t>(i), {}, bytes});
    }
    store->append(messages);
  }
  return store;
}

TEST(Query, explainsWhatItRead) {
  const auto store = countingStore(20);
  EXPECT_EQ(store->explain(where(R"({"/count": {"data": {"$gt": 18000}}})")).back(),
            "filter: 2 of 20 match; messages read: 18003")
      << "18,000 that do not match, one in the last behavior, two in the one before it";
  EXPECT_EQ(store->explain(where(R"({"name": "3", "/count": {"data": 3500}})")),
            (std::vector<std::string>{"behaviors: index by name, 1 of 20",
                                      "filter: 1 of 1 match; messages read: 501"}));
}

/// 300 behaviors are more than are looked at in one round.
TEST(Query, givesTheSameOnSeveralThreadsAndInATransaction) {
  const TempFolder folder;
  const auto store = countingStore(300, openStore(folder.path("store.db"), OpenMode::ReadWrite));
  BehaviorFilter filter = where(R"({"/count": {"data": {"$gt": 250000}}})");
  EXPECT_EQ(store->behaviors(filter).size(), 50u);
  filter.limit = 3;
  EXPECT_EQ(namesOf(store->behaviors(filter)), (Names{"299", "298", "297"}));
  filter.limit = 100;
  filter.where = where(R"({"/count": {"data": {"$lt": 5000}}})").where;
  EXPECT_EQ(namesOf(store->behaviors(filter)), (Names{"4", "3", "2", "1", "0"}));
  store->transaction([&] {
    store->append({{1, Stamp{299'500}, 1'000'000, {}, {0, 0, 0, 0x80}}});
    EXPECT_EQ(ask(*store, R"({"/count": {"data": {"$lt": 0}}})"), Names{"299"}) << "not yet stored";
  });
  EXPECT_EQ(ask(*store, R"({"/count": {"data": {"$lt": 0}}})"), Names{"299"});
}

TEST(Query, staysRightWhenBehaviorsAreRemoved) {
  const auto store = countingStore(5);
  Behavior shorter = store->behaviors(where(R"({"name": "2"})")).at(0);
  Behavior other = shorter;
  other.id = 0;
  other.key.clear();
  other.name = "inner";
  other.begin = {2300};
  other.end = Stamp{2400};
  store->addBehavior(other);
  store->removeBehavior(shorter.id);
  EXPECT_EQ(ask(*store, R"({"/count": {"data": {"$gt": 2350, "$lt": 2360}}})"), Names{"inner"});
  EXPECT_TRUE(ask(*store, R"({"/count": {"data": {"$gt": 2450, "$lt": 2460}}})").empty());
  EXPECT_EQ(ask(*store, R"({"/count": {"data": 3999}})"), Names{"3"});
}

TEST(Query, staysRightWhenATransactionIsUndone) {
  const auto store = countingStore(1);
  const auto recording = store->recordings().at(0).id;
  EXPECT_THROW(store->transaction([&] {
    store->append({{1, Stamp{500}, 5000, {}, {0xff, 0xff, 0, 0}}});
    throw std::runtime_error("undone");
  }),
               std::runtime_error);
  EXPECT_TRUE(ask(*store, R"({"/count": {"data": 65535}})").empty());
  store->append({{1, Stamp{500}, 5000, {}, {0xff, 0xff, 0, 0}}});
  EXPECT_EQ(ask(*store, R"({"/count": {"data": 65535}})").size(), 1u);
  EXPECT_THROW(store->append({{1, Stamp{501}, 6000, {}, {0xee, 0xff, 0, 0}},
                              {1, Stamp{500}, 5000, {}, {0xff, 0xff, 0, 0}}}),
               StoreError);
  EXPECT_TRUE(ask(*store, R"({"/count": {"data": 65518}})").empty());
  EXPECT_EQ(ask(*store, R"({"/count": {"data": 500}})").size(), 1u);
  EXPECT_GT(recording, 0);
}

TEST(Query, takesMessagesThatComeOutOfOrder) {
  const auto store = openMemoryStore();
  const auto recording = store->addRecording({0, "", "test", ""});
  const auto channel = store->addChannel(recording, stringChannel("/said"));
  std::mt19937 random(3);
  std::vector<std::int64_t> times(2000);
  for (std::size_t i = 0; i < times.size(); ++i) times[i] = static_cast<std::int64_t>(i);
  std::shuffle(times.begin(), times.end(), random);
  for (const std::int64_t time : times) {
    store->append({stringMessage(channel, time, static_cast<std::uint64_t>(time),
                                 "word " + std::to_string(time))});
  }
  for (std::int64_t begin = 0; begin < 2000; begin += 100) {
    Behavior behavior = sampleBehavior(recording, {"/said"}, begin, begin + 100);
    behavior.name = std::to_string(begin);
    store->addBehavior(behavior);
  }
  EXPECT_EQ(ask(*store, R"({"/said": {"data": "word 1234"}})"), Names{"1200"});
  EXPECT_EQ(ask(*store, R"({"/said": {"data": "word 1999"}})"), Names{"1900"});
}

}  // namespace
}  // namespace afterglow::replay::query_test

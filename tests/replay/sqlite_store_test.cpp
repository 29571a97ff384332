#include "replay/store/sqlite_store.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "replay/store/sqlite.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay {
namespace {

using namespace afterglow::test;
using Texts = std::vector<std::string>;

/// What a StoreError says; "" if `work` throws none.
template <typename Work>
std::string errorOf(const Work& work) {
  try {
    work();
  } catch (const StoreError& error) {
    return error.what();
  }
  return "";
}

/// A store in a file with one recording and one channel on /a.
class SqliteStoreTest : public testing::Test {
 protected:
  TempFolder folder_;
  std::string path_ = folder_.path("store.db");
  std::unique_ptr<Store> store_ = openStore("sqlite:" + path_, OpenMode::ReadWrite);
  std::int64_t recording_ = store_->addRecording({0, "", "/recorder", ""});
  std::int64_t channel_ = store_->addChannel(recording_, stringChannel("/a"));

  std::int64_t count(const std::string& table) {
    SqliteConnection connection(path_, SqliteAccess::ReadOnly);
    return connection.integer("SELECT count(*) FROM " + table);
  }
};

// ---------------------------------------------------------------------------------- what it keeps

TEST_F(SqliteStoreTest, givesBackEveryFieldOfABehavior) {
  Behavior written = sampleBehavior(recording_, {"/a", "/b"}, 10, 20);
  written.tree_path = "kitting/pick \"quoted\"";
  written.parent = 7;
  written.attempt = 3;
  written.outcome = "failure";
  written.robot = "fetch21";
  written.parameters = R"({"object":"gearbox","mass_kg":0.25})";
  written.tags = {"demo", "ünïcode, with comma"};
  written.calibration = R"({"K":[1900.0]})";
  written.id = store_->addBehavior(written);
  store_ = openStore(path_, OpenMode::ReadOnly);

  const auto read = store_->behavior(written.id);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->id, written.id);
  EXPECT_EQ(read->recording, recording_);
  EXPECT_EQ(read->name, written.name);
  EXPECT_EQ(read->tree_path, written.tree_path);
  EXPECT_EQ(read->parent, 7);
  EXPECT_EQ(read->attempt, 3);
  EXPECT_EQ(read->outcome, "failure");
  EXPECT_EQ(read->begin, Stamp{10});
  EXPECT_EQ(read->end, Stamp{20});
  EXPECT_EQ(read->robot, "fetch21");
  EXPECT_EQ(read->parameters, written.parameters);
  EXPECT_EQ(read->tags, written.tags);
  EXPECT_EQ(read->calibration, written.calibration);
  EXPECT_EQ(read->topics, written.topics);
  EXPECT_FALSE(store_->behavior(written.id + 1));
}

TEST_F(SqliteStoreTest, endsABehaviorOnce) {
  Behavior behavior = sampleBehavior(recording_, {"/a"}, 10, 0);
  behavior.end.reset();
  const auto id = store_->addBehavior(behavior);
  EXPECT_FALSE(store_->behavior(id)->end);
  endBehavior(*store_, id, Stamp{30}, "success");
  EXPECT_EQ(store_->behavior(id)->end, Stamp{30});
  EXPECT_EQ(store_->behavior(id)->outcome, "success");
  EXPECT_NE(errorOf([&] { endBehavior(*store_, 99, Stamp{1}, ""); }).find("no behavior 99"),
            std::string::npos);
}

TEST_F(SqliteStoreTest, refusesWhatIsNoJsonObject) {
  Behavior behavior = sampleBehavior(recording_, {"/a"}, 10, 20);
  behavior.parameters = "{broken";
  EXPECT_EQ(errorOf([&] { store_->addBehavior(behavior); }),
            "sqlite:" + path_ + ": parameters of behavior \"pick\" are no JSON object");
  EXPECT_EQ(count("behaviors"), 0);
}

TEST_F(SqliteStoreTest, storesAChannelAndADefinitionOnce) {
  EXPECT_EQ(store_->addChannel(recording_, stringChannel("/a")), channel_);
  const auto latched = store_->addChannel(recording_, stringChannel("/a", "/talker", true));
  EXPECT_NE(latched, channel_);
  EXPECT_NE(store_->addChannel(recording_, stringChannel("/a", "/other")), channel_);
  const auto other =
      store_->addChannel(store_->addRecording({0, "", "x", ""}), stringChannel("/a"));
  EXPECT_NE(other, channel_);
  EXPECT_EQ(count("channels"), 4);
  EXPECT_EQ(count("definitions"), 1);
  EXPECT_EQ(store_->channel(latched), stringChannel("/a", "/talker", true));
}

TEST_F(SqliteStoreTest, namesUnknownRecordingsAndChannels) {
  EXPECT_NE(errorOf([&] { store_->addChannel(9, stringChannel("/a")); }).find("no recording 9"),
            std::string::npos);
  EXPECT_NE(errorOf([&] { store_->channel(9); }).find("no channel 9"), std::string::npos);
  EXPECT_NE(errorOf([&] { store_->append({stringMessage(9, 1, 0, "x")}); }).find("no channel 9"),
            std::string::npos);
}

TEST_F(SqliteStoreTest, keepsMessagesByteForByte) {
  Message written = stringMessage(channel_, 10, 0, std::string("\0\xff\x80'\"", 5));
  written.header_stamp = Stamp{-5};
  store_->append({written});
  const auto read = readAll(*store_->messages(sampleBehavior(recording_, {"/a"}, 10, 11), {}));
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read[0].channel, channel_);
  EXPECT_EQ(read[0].received, Stamp{10});
  EXPECT_EQ(read[0].sequence, 0u);
  EXPECT_EQ(read[0].header_stamp, Stamp{-5});
  EXPECT_EQ(read[0].bytes, written.bytes);
}

TEST_F(SqliteStoreTest, decodesMessagesIntoDocumentsThatCanBeQueried) {
  store_->append({stringMessage(channel_, 1, 0, "hello")});
  SqliteConnection connection(path_, SqliteAccess::ReadOnly);
  EXPECT_EQ(connection.integer("SELECT count(*) FROM messages WHERE "
                               "json_extract(document, '$.data') = 'hello'"),
            1);
}

TEST_F(SqliteStoreTest, keepsBytesThatCannotBeDecoded) {
  Channel strange = stringChannel("/strange");
  strange.definition = "no/such type of field!";
  const auto strange_channel = store_->addChannel(recording_, strange);
  Message damaged = stringMessage(channel_, 2, 1, "x");
  damaged.bytes = {9, 0, 0, 0};  // announces nine characters, holds none
  Message empty = stringMessage(strange_channel, 3, 2, "");
  empty.bytes.clear();
  store_->append({stringMessage(strange_channel, 1, 0, "x"), damaged, empty});
  EXPECT_EQ(count("messages WHERE document IS NULL"), 3);
  const auto read =
      readAll(*store_->messages(sampleBehavior(recording_, {"/a", "/strange"}, 0, 9), {}));
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[1].bytes, damaged.bytes);
  EXPECT_TRUE(read[2].bytes.empty());
}

TEST_F(SqliteStoreTest, leavesOutDocumentsThatWouldBeTooLong) {
  store_->append({stringMessage(channel_, 1, 0, std::string(SqliteLimits().longest_document, 'x')),
                  stringMessage(channel_, 2, 1, std::string(1000, 'x'))});
  EXPECT_EQ(count("messages WHERE document IS NULL"), 1);
}

// ------------------------------------------------------------------------------ order and ranges

TEST_F(SqliteStoreTest, ordersByStampThenSequence) {
  const auto b = store_->addChannel(recording_, stringChannel("/b"));
  store_->append({stringMessage(b, 20, 4, "e"), stringMessage(channel_, 20, 2, "c"),
                  stringMessage(channel_, 10, 1, "a"), stringMessage(b, 10, 3, "b"),
                  stringMessage(b, 20, 3, "d")});
  EXPECT_EQ(readTexts(*store_, sampleBehavior(recording_, {"/a", "/b"}, 0, 100)),
            (Texts{"a", "b", "c", "d", "e"}));
}

TEST_F(SqliteStoreTest, takesAnIntervalAsHalfOpen) {
  store_->append({stringMessage(channel_, 9, 0, "before"), stringMessage(channel_, 10, 1, "first"),
                  stringMessage(channel_, 19, 2, "last"), stringMessage(channel_, 20, 3, "after")});
  const Behavior behavior = sampleBehavior(recording_, {"/a"}, 10, 20);
  EXPECT_EQ(readTexts(*store_, behavior), (Texts{"first", "last"}));
  EXPECT_EQ(readTexts(*store_, behavior, {{}, Stamp{11}, {}}), (Texts{"last"}));
  EXPECT_EQ(readTexts(*store_, behavior, {{}, {}, Stamp{19}}), (Texts{"first"}));
  EXPECT_EQ(readTexts(*store_, behavior, {{}, Stamp{0}, Stamp{99}}), (Texts{"first", "last"}));
}

TEST_F(SqliteStoreTest, readsABehaviorWithoutAnEndToTheLastMessage) {
  store_->append({stringMessage(channel_, 10, 0, "a"), stringMessage(channel_, 99, 1, "z")});
  Behavior behavior = sampleBehavior(recording_, {"/a"}, 10, 0);
  behavior.end.reset();
  EXPECT_EQ(readTexts(*store_, behavior), (Texts{"a", "z"}));
  EXPECT_EQ(store_->topics(behavior).at(0).last, Stamp{99});
}

TEST_F(SqliteStoreTest, readsOwnTopicsUnlessOthersAreNamed) {
  const auto tf = store_->addChannel(recording_, stringChannel("/tf"));
  const auto elsewhere =
      store_->addChannel(store_->addRecording({0, "", "x", ""}), stringChannel("/a"));
  store_->append({stringMessage(channel_, 10, 0, "own"), stringMessage(tf, 11, 1, "context"),
                  stringMessage(elsewhere, 12, 0, "another recording's")});
  const Behavior behavior = sampleBehavior(recording_, {"/a", "/never"}, 0, 100);
  EXPECT_EQ(readTexts(*store_, behavior), (Texts{"own"}));
  EXPECT_EQ(readTexts(*store_, behavior, {{"/tf"}, {}, {}}), (Texts{"context"}));
  EXPECT_EQ(readTexts(*store_, behavior, {{"/a", "/tf"}, {}, {}}), (Texts{"own", "context"}));

  ASSERT_EQ(store_->topics(behavior).size(), 1u);
  EXPECT_EQ(store_->topics(behavior)[0].topic, "/a");
  EXPECT_EQ(store_->topics(behavior)[0].type, "std_msgs/String");
  EXPECT_EQ(store_->topics(behavior)[0].count, 1u);
  EXPECT_EQ(store_->topics(behavior)[0].first, Stamp{10});
  ASSERT_EQ(store_->contextTopics(behavior).size(), 1u);
  EXPECT_EQ(store_->contextTopics(behavior)[0].topic, "/tf");
}

TEST_F(SqliteStoreTest, readsAcrossPages) {
  std::vector<Message> batch;
  Texts expected;
  for (int i = 0; i < 5000; ++i) {
    // Stamps in threes, so that pages end between equal ones.
    batch.push_back(
        stringMessage(channel_, i / 3, static_cast<std::uint64_t>(i), std::to_string(i)));
    expected.push_back(std::to_string(i));
  }
  for (int i = 5000; i < 5003; ++i) {
    const std::string large(3 << 20, static_cast<char>('a' + i % 3));
    batch.push_back(stringMessage(channel_, i, static_cast<std::uint64_t>(i), large));
    expected.push_back(large);
  }
  store_->append(batch);
  EXPECT_EQ(readTexts(*store_, sampleBehavior(recording_, {"/a"}, 0, 9999)), expected);
}

TEST_F(SqliteStoreTest, refusesAMessageTwiceAndTheWholeBatchWithIt) {
  store_->append({stringMessage(channel_, 10, 5, "a")});
  EXPECT_NE(errorOf([&] {
              store_->append(
                  {stringMessage(channel_, 11, 6, "b"), stringMessage(channel_, 10, 5, "again")});
            }),
            "");
  EXPECT_EQ(readTexts(*store_, sampleBehavior(recording_, {"/a"}, 0, 100)), (Texts{"a"}));
  store_->append({stringMessage(channel_, 11, 6, "b")});
  EXPECT_EQ(count("messages"), 2);
}

TEST_F(SqliteStoreTest, refusesAMessageThatNoRowCanHold) {
  SqliteLimits limits;
  EXPECT_LT(limits.largest_message + limits.longest_document + 1000, 1'000'000'000u);
  limits.largest_message = 20;
  SqliteStore store(path_, OpenMode::ReadWrite, limits);
  store.append({stringMessage(channel_, 1, 0, std::string(16, 'x'))});
  EXPECT_EQ(errorOf([&] { store.append({stringMessage(channel_, 2, 1, std::string(17, 'x'))}); }),
            "sqlite:" + path_ + ": a message of 21 bytes is larger than a store can hold (20)");
  EXPECT_EQ(count("messages"), 1);
}

// --------------------------------------------------------------------------------------- filters

TEST_F(SqliteStoreTest, findsBehaviors) {
  const auto add = [&](const std::string& name, const std::string& outcome, std::int64_t begin,
                       std::optional<Stamp> end, std::vector<std::string> topics) {
    Behavior behavior = sampleBehavior(recording_, std::move(topics), begin, 0);
    behavior.name = name;
    behavior.outcome = outcome;
    behavior.end = end;
    return store_->addBehavior(behavior);
  };
  store_->append({stringMessage(channel_, 15, 0, "x"), stringMessage(channel_, 40, 1, "y")});
  const auto pick = add("pick", "success", 10, Stamp{20}, {"/a"});
  const auto place = add("place", "failure", 20, Stamp{30}, {"/a"});
  const auto again = add("pick", "failure", 20, Stamp{35}, {"/b"});
  const auto cut_off = add("pick", "", 25, {}, {"/a"});

  const auto ids = [&](const BehaviorFilter& filter) {
    std::vector<std::int64_t> found;
    for (const Behavior& behavior : store_->behaviors(filter)) found.push_back(behavior.id);
    return found;
  };
  using Ids = std::vector<std::int64_t>;
  EXPECT_EQ(ids({}), (Ids{cut_off, again, place, pick})) << "newest first";
  BehaviorFilter filter;
  filter.name = "pick";
  EXPECT_EQ(ids(filter), (Ids{cut_off, again, pick}));
  filter.outcome = "failure";
  EXPECT_EQ(ids(filter), (Ids{again}));
  filter = {};
  filter.topic = "/a";
  EXPECT_EQ(ids(filter), (Ids{cut_off, pick})) << "own topics that were heard";
  filter = {};
  filter.since = Stamp{30};
  EXPECT_EQ(ids(filter), (Ids{cut_off, again})) << "place ends at 30, not after it";
  filter.since = Stamp{40};
  EXPECT_EQ(ids(filter), (Ids{cut_off})) << "its recording's last message is at 40";
  filter.since = Stamp{41};
  EXPECT_EQ(ids(filter), (Ids{}));
  filter = {};
  filter.until = Stamp{20};
  EXPECT_EQ(ids(filter), (Ids{pick}));
}

// -------------------------------------------------------------------- transactions and concurrency

TEST_F(SqliteStoreTest, dropsAllOfAFailedTransaction) {
  std::int64_t dropped = 0;
  EXPECT_THROW(store_->transaction([&] {
    dropped =
        store_->addChannel(store_->addRecording({0, "", "dropped", ""}), stringChannel("/dropped"));
    store_->append({stringMessage(dropped, 1, 0, "dropped")});
    throw std::runtime_error("enough");
  }),
               std::runtime_error);
  EXPECT_EQ(count("recordings"), 1);
  EXPECT_EQ(count("messages"), 0);
  // The id is given out again; nothing of the dropped channel may stick to it.
  Channel strange = stringChannel("/strange");
  strange.definition = "not a definition";
  ASSERT_EQ(store_->addChannel(recording_, strange), dropped);
  store_->append({stringMessage(dropped, 2, 0, "kept")});
  EXPECT_EQ(count("messages WHERE document IS NULL AND recording = 1"), 1);
}

TEST_F(SqliteStoreTest, keepsAllOfATransaction) {
  store_->transaction([&] {
    store_->append({stringMessage(channel_, 1, 0, "a")});
    EXPECT_EQ(count("messages"), 0) << "seen by others before it is complete";
    store_->append({stringMessage(channel_, 2, 1, "b")});
  });
  EXPECT_EQ(count("messages"), 2);
}

TEST_F(SqliteStoreTest, readsOnWhileAnotherConnectionWrites) {
  std::vector<Message> batch;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    batch.push_back(stringMessage(channel_, static_cast<std::int64_t>(i), i, "x"));
  }
  store_->append(batch);
  const auto reader = openStore(path_, OpenMode::ReadOnly);
  const auto cursor = reader->messages(sampleBehavior(recording_, {"/a"}, 0, 99999), {});
  ASSERT_TRUE(cursor->next());
  store_->append({stringMessage(channel_, 4000, 4000, "written meanwhile")});
  store_->transaction([&] {
    store_->append({stringMessage(channel_, 4001, 4001, "not committed yet")});
    EXPECT_EQ(readAll(*cursor).size(), 4000u) << "3999 and the one written meanwhile";
  });
  ASSERT_TRUE(cursor->next()) << "an end is not for ever";
}

TEST_F(SqliteStoreTest, servesSeveralThreads) {
  const auto b = store_->addChannel(recording_, stringChannel("/b"));
  const auto write = [&](std::int64_t channel, std::uint64_t first) {
    for (std::uint64_t i = 0; i < 200; ++i) {
      const auto at = static_cast<std::int64_t>(first + i);
      store_->append({stringMessage(channel, at, first + i, "x")});
    }
  };
  std::thread one([&] { write(channel_, 0); });
  std::thread two([&] { write(b, 1000); });
  const Behavior behavior = sampleBehavior(recording_, {"/a", "/b"}, 0, 99999);
  std::size_t seen = 0;
  while (seen < 400) seen = readAll(*store_->messages(behavior, {})).size();
  one.join();
  two.join();
  EXPECT_EQ(seen, 400u);
}

TEST_F(SqliteStoreTest, letsTwoStoresWriteToOneFile) {
  const auto second = openStore(path_, OpenMode::ReadWrite);
  const auto b =
      second->addChannel(second->addRecording({0, "", "/second", ""}), stringChannel("/a"));
  std::thread other([&] {
    for (std::uint64_t i = 0; i < 100; ++i) second->append({stringMessage(b, 1, i, "x")});
  });
  for (std::uint64_t i = 0; i < 100; ++i) store_->append({stringMessage(channel_, 1, i, "x")});
  other.join();
  EXPECT_EQ(count("messages"), 200);
}

TEST(MemoryStore, isAStoreOfItsOwn) {
  const auto first = openMemoryStore();
  const auto second = openMemoryStore();
  const auto recording = first->addRecording({0, "", "x", ""});
  const auto channel = first->addChannel(recording, stringChannel("/a"));
  first->append({stringMessage(channel, 1, 0, "a")});
  first->addBehavior(sampleBehavior(recording, {"/a"}, 0, 9));
  EXPECT_EQ(readTexts(*first, first->behaviors({}).at(0)), (Texts{"a"}));
  EXPECT_TRUE(second->behaviors({}).empty());
}

}  // namespace
}  // namespace afterglow::replay

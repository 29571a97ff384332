#include "replay/store/sqlite/sqlite_store.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

#include "replay/store/open/open_store.hpp"
#include "replay/store/sqlite/sqlite.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::sqlite_store_test {
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
  behavior.id = 99;
  EXPECT_NE(errorOf([&] { store_->updateBehavior(behavior); }).find("no behavior 99"),
            std::string::npos);
}

TEST_F(SqliteStoreTest, refusesWhatIsNoJsonObject) {
  Behavior behavior = sampleBehavior(recording_, {"/a"}, 10, 20);
  behavior.parameters = "{broken";
  EXPECT_EQ(errorOf([&] { store_->addBehavior(behavior); }),
            "sqlite:" + path_ + ": parameters of behavior \"pick\": no JSON object");
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

TEST_F(SqliteStoreTest, keepsBytesThatCannotBeDecoded) {
  Channel strange = stringChannel("/strange");
  strange.definition = "no/such type of field!";
  const auto strange_channel = store_->addChannel(recording_, strange);
  Message damaged = stringMessage(channel_, 2, 1, "x");
  damaged.bytes = {9, 0, 0, 0};  // announces nine characters, holds none
  Message empty = stringMessage(strange_channel, 3, 2, "");
  empty.bytes.clear();
  store_->append({stringMessage(strange_channel, 1, 0, "x"), damaged, empty});
  const auto read =
      readAll(*store_->messages(sampleBehavior(recording_, {"/a", "/strange"}, 0, 9), {}));
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[1].bytes, damaged.bytes);
  EXPECT_TRUE(read[2].bytes.empty());
}

TEST_F(SqliteStoreTest, keepsLargeMessagesInChunks) {
  Message written = stringMessage(channel_, 1, 0, "");
  for (std::size_t i = 0; i < 2 * kSqliteChunkBytes + 5; ++i) {
    written.bytes.push_back(static_cast<std::uint8_t>(i * i >> 7));
  }
  store_->append({written, stringMessage(channel_, 2, 1, "small")});
  EXPECT_EQ(count("chunks"), 3);
  const Behavior behavior = sampleBehavior(recording_, {"/a"}, 0, 9);
  const auto read = readAll(*store_->messages(behavior, {}));
  ASSERT_EQ(read.size(), 2u);
  EXPECT_TRUE(read[0].bytes == written.bytes);
  store_->removeBehavior(store_->addBehavior(behavior));
  EXPECT_EQ(count("chunks"), 0);
  EXPECT_EQ(count("messages"), 0);
}

TEST_F(SqliteStoreTest, leavesOutAndReportsDamagedMessages) {
  const Message large = stringMessage(channel_, 2, 1, std::string(2 * kSqliteChunkBytes, 'x'));
  store_->append({stringMessage(channel_, 1, 0, "first"), large,
                  stringMessage(channel_, 3, 2, "third"),
                  stringMessage(channel_, 4, 3, std::string(2 * kSqliteChunkBytes, 'y')),
                  stringMessage(channel_, 5, 4, "last")});
  {
    SqliteConnection connection(path_, SqliteAccess::ReadWriteCreate);
    connection.execute("UPDATE messages SET bytes = x'0500000066697254' WHERE sequence = 0");
    connection.execute("UPDATE chunks SET bytes = zeroblob(7) WHERE message = 2 AND number = 1");
    connection.execute("DELETE FROM chunks WHERE message = 4 AND number = 1");
  }
  const auto cursor = store_->messages(sampleBehavior(recording_, {"/a"}, 0, 9), {});
  Texts texts;
  while (const auto message = cursor->next()) texts.push_back(textOf(*message));
  EXPECT_EQ(texts, (Texts{"third", "last"}));
  const auto damaged = cursor->damaged();
  ASSERT_EQ(damaged.size(), 3u);
  EXPECT_EQ(damaged[0].channel, channel_);
  EXPECT_EQ(damaged[0].received, Stamp{1});
  EXPECT_EQ(damaged[0].problem, "8 of 9 bytes are there");
  EXPECT_EQ(damaged[1].problem, "the checksum of chunk 1 is another");
  EXPECT_EQ(damaged[2].problem, "chunk 1 is missing");
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

TEST_F(SqliteStoreTest, refusesAMessageThatIsTooLarge) {
  SqliteLimits limits;
  limits.largest_message = 20;
  SqliteStore store(path_, OpenMode::ReadWrite, limits);
  store.append({stringMessage(channel_, 1, 0, std::string(16, 'x'))});
  EXPECT_EQ(errorOf([&] { store.append({stringMessage(channel_, 2, 1, std::string(17, 'x'))}); }),
            "sqlite:" + path_ + ": a message of 21 bytes is larger than a store can hold (20)");
  EXPECT_EQ(count("messages"), 1);
}

// ------------------------------------------------------------------------------ counts and removal

TEST_F(SqliteStoreTest, countsWhatABehaviorHolds) {
  const auto b = store_->addChannel(recording_, stringChannel("/b"));
  store_->append({stringMessage(channel_, 10, 0, "x"), stringMessage(b, 11, 1, "x")});
  Behavior behavior = sampleBehavior(recording_, {"/a", "/b"}, 10, 0);
  behavior.end.reset();
  behavior.id = store_->addBehavior(behavior);
  // As the messages have it, the index of which the same behavior without its id is counted by.
  const auto expectCounts = [&] {
    Behavior unknown = *store_->behavior(behavior.id);
    const auto counted = store_->topics(unknown);
    unknown.id = 0;
    const auto expected = store_->topics(unknown);
    ASSERT_EQ(counted.size(), expected.size());
    for (std::size_t i = 0; i < counted.size(); ++i) {
      EXPECT_EQ(counted[i].topic, expected[i].topic);
      EXPECT_EQ(counted[i].count, expected[i].count);
      EXPECT_EQ(counted[i].first, expected[i].first);
      EXPECT_EQ(counted[i].last, expected[i].last);
    }
  };
  expectCounts();
  store_->append({stringMessage(channel_, 9, 2, "before"), stringMessage(channel_, 20, 3, "x")});
  store_->append({stringMessage(channel_, 15, 4, "late"), stringMessage(channel_, 20, 3, "twice")},
                 Duplicates::Skip);
  EXPECT_EQ(store_->topics(*store_->behavior(behavior.id)).at(0).count, 3u);
  expectCounts();
  endBehavior(*store_, behavior.id, Stamp{20}, "success");
  EXPECT_EQ(store_->topics(*store_->behavior(behavior.id)).at(0).last, Stamp{15});
  expectCounts();
  store_->append({stringMessage(channel_, 20, 5, "after"), stringMessage(channel_, 19, 6, "late")});
  expectCounts();
  store_->removeBehavior(behavior.id);
  EXPECT_EQ(count("behavior_counts"), 0);
}

TEST_F(SqliteStoreTest, removesTheMessagesThatNoOtherBehaviorCovers) {
  for (std::int64_t at = 0; at < 12; ++at) {
    store_->append({stringMessage(channel_, at, static_cast<std::uint64_t>(at), "x")});
  }
  const auto add = [&](std::int64_t begin, std::int64_t end) {
    return store_->addBehavior(sampleBehavior(recording_, {"/a"}, begin, end));
  };
  const auto removed = add(1, 10);
  Behavior child = sampleBehavior(recording_, {"/a"}, 2, 4);
  child.parent = removed;
  child.id = store_->addBehavior(child);
  add(3, 5);
  add(7, 8);
  add(9, 20);
  store_->removeBehavior(removed);
  std::vector<std::int64_t> left;
  for (const Message& message :
       readAll(*store_->messages(sampleBehavior(recording_, {"/a"}, 0, 99), {}))) {
    left.push_back(message.received.ns);
  }
  EXPECT_EQ(left, (std::vector<std::int64_t>{0, 2, 3, 4, 7, 9, 10, 11}));
  EXPECT_EQ(store_->behavior(child.id)->parent, 0);
}

TEST_F(SqliteStoreTest, removesMuchInSlices) {
  std::vector<Message> batch;
  for (std::uint64_t i = 0; i < 12'000; ++i) {
    // Stamps in threes, so that slices end between equal ones.
    batch.push_back(stringMessage(channel_, static_cast<std::int64_t>(i / 3), i, "x"));
  }
  store_->append(batch);
  const auto removed = store_->addBehavior(sampleBehavior(recording_, {"/a"}, 0, 4000));
  store_->addBehavior(sampleBehavior(recording_, {"/a"}, 3900, 3901));
  store_->removeBehavior(removed);
  EXPECT_EQ(count("messages"), 3);
  EXPECT_EQ(count("behavior_counts"), 1);
}

// ---------------------------------------------------------------------------------- the recorder

TEST_F(SqliteStoreTest, hasOneRecorderAtATime) {
  auto recorder = openStore(path_, OpenMode::Record);
  EXPECT_EQ(
      errorOf([&] {
        openStore(path_, OpenMode::Record);
      }).find("sqlite:" + path_ + ": cannot record: process " + std::to_string(getpid()) + " on "),
      0u);
  EXPECT_EQ(errorOf([&] {
              openStore(path_, OpenMode::ReadOnly)->behaviors({});
              openStore(path_, OpenMode::ReadWrite)->addRecording({0, "", "an import", ""});
            }),
            "");
  recorder.reset();
  EXPECT_EQ(errorOf([&] { openStore(path_, OpenMode::Record); }), "") << "a stale file is no lock";
}

TEST_F(SqliteStoreTest, marksBehaviorsThatADeadRecorderLeftOpen) {
  store_->append({stringMessage(channel_, 15, 0, "x"), stringMessage(channel_, 40, 1, "y")});
  Behavior open = sampleBehavior(recording_, {"/a"}, 10, 0);
  open.end.reset();
  open.id = store_->addBehavior(open);
  open.begin = Stamp{50};
  const auto later = store_->addBehavior([&] {
    Behavior behavior = open;
    behavior.id = 0;
    return behavior;
  }());
  BehaviorFilter incomplete;
  incomplete.outcome = kIncomplete;
  auto reader = openStore(path_, OpenMode::ReadOnly);
  EXPECT_EQ(reader->behaviors(incomplete).size(), 2u) << "told by the lock that nobody holds";
  EXPECT_EQ(reader->behavior(open.id)->outcome, kIncomplete);

  const auto recorder = openStore(path_, OpenMode::Record);
  EXPECT_EQ(recorder->behaviors(incomplete).size(), 2u);
  const auto marked = recorder->behavior(open.id);
  EXPECT_EQ(marked->end, Stamp{41});
  EXPECT_EQ(marked->remarks, (Texts{"Its recorder died; it ends with the last message stored."}));
  EXPECT_EQ(readTexts(*recorder, *marked), (Texts{"x", "y"}));
  EXPECT_EQ(recorder->behavior(later)->end, Stamp{50});

  open.id = recorder->addBehavior([&] {
    Behavior behavior = open;
    behavior.id = 0;
    return behavior;
  }());
  EXPECT_EQ(reader->behavior(open.id)->outcome, "") << "it runs";
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
  filter = {};
  filter.limit = 2;
  EXPECT_EQ(ids(filter), (Ids{cut_off, again}));
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
  EXPECT_EQ(count("messages WHERE recording = 1"), 1);
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

/// Whether a process other than this one finds the file locked.
bool isLockedForOthers(const std::string& path) {
  const pid_t other = fork();
  if (other == 0) {
    const int file = open(path.c_str(), O_RDWR | O_CLOEXEC);
    struct flock lock {};
    lock.l_type = F_WRLCK;
    lock.l_whence = SEEK_SET;
    const bool is_known = file >= 0 && fcntl(file, F_GETLK, &lock) == 0;
    _exit(is_known && lock.l_type == F_UNLCK ? 1 : 0);
  }
  int status = 0;
  waitpid(other, &status, 0);
  return WEXITSTATUS(status) == 0;
}

TEST_F(SqliteStoreTest, keepsItsLocksWhenItIsOpenedOnceMore) {
  ASSERT_TRUE(isLockedForOthers(path_));
  { const auto again = openStore(path_, OpenMode::ReadOnly); }
  EXPECT_TRUE(isLockedForOthers(path_));
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
}  // namespace afterglow::replay::sqlite_store_test

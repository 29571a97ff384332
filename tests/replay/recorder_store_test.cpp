// A recorder's behaviors reach a server that is slow, away, killed: all of them, once.
#include "replay/store/open/recorder_store.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>

#include "replay/store/mongo/mongo_layout.hpp"
#include "replay/store/mongo/mongo_open.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/sqlite/sqlite.hpp"
#include "tests/support/mongo_server.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::recorder_store_test {
namespace {

using namespace std::chrono_literals;
using test::endBehavior;
using test::sampleBehavior;
using test::stringChannel;
using test::stringMessage;

class RecorderStoreTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const auto why = test::MongoServer::absence()) GTEST_SKIP() << *why;
    server.emplace();
    if (!server->isOwn()) GTEST_SKIP() << "the server is not this test's to stop";
    uri = server->uri("serverSelectionTimeoutMS=500&socketTimeoutMS=500&connectTimeoutMS=500");
    open();
  }

  void open(std::chrono::milliseconds farewell = 2s) {
    store.reset();
    store = std::make_unique<RecorderStore>(
        uri, SendOptions{folder.path("spool.db"), farewell, 10ms, 5ms});
  }

  std::int64_t begin(const std::string& name = "pick", std::int64_t parent = 0) {
    if (recording == 0) {
      recording = store->local().addRecording({0, "", "test", "fetch7"});
      channel = store->local().addChannel(recording, stringChannel("/a"));
    }
    Behavior behavior = sampleBehavior(recording, {"/a"}, 0, 0);
    behavior.id = store->newBehaviorId();
    behavior.name = name;
    behavior.parent = parent;
    behavior.end.reset();
    return store->local().addBehavior(behavior);
  }
  /// Messages [from, to), one a batch.
  void append(int from, int to) {
    for (int i = from; i < to; ++i) {
      store->local().append(
          {stringMessage(channel, i, static_cast<std::uint64_t>(i), std::to_string(i))});
    }
  }
  void end(std::int64_t id, int at) { endBehavior(store->local(), id, Stamp{at}, "success"); }

  template <typename Condition>
  static bool eventually(const Condition& condition) {
    const auto deadline = std::chrono::steady_clock::now() + 30s;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      std::this_thread::sleep_for(10ms);
    }
    return true;
  }
  /// The server has so many behaviors, and they have ended.
  bool hasArrived(std::size_t count) const {
    return eventually([&] {
      try {
        const auto found = openStore(uri, OpenMode::ReadOnly)->behaviors({});
        return found.size() == count &&
               std::all_of(found.begin(), found.end(), [](const auto& b) { return b.end; });
      } catch (const StoreError&) {  // nothing was ever written there
        return false;
      }
    });
  }
  /// What the server has of the one behavior, read by another store.
  std::vector<std::string> arrived() const {
    const auto reader = openStore(uri, OpenMode::ReadOnly);
    const auto behaviors = reader->behaviors({});
    EXPECT_EQ(behaviors.size(), 1u);
    EXPECT_EQ(reader->recordings().size(), 1u);
    return behaviors.empty() ? std::vector<std::string>{}
                             : test::readTexts(*reader, behaviors.front());
  }
  static std::vector<std::string> numbers(int count) {
    std::vector<std::string> texts;
    for (int i = 0; i < count; ++i) texts.push_back(std::to_string(i));
    return texts;
  }

  test::TempFolder folder;
  std::optional<test::MongoServer> server;
  std::string uri;
  std::unique_ptr<RecorderStore> store;
  std::int64_t recording = 0, channel = 0;
};

TEST_F(RecorderStoreTest, aBehaviorReachesTheServerWhenItEnds) {
  const std::int64_t id = begin();
  append(0, 10);
  const std::string sum(64, 'a');
  store->local().addFile(sum, {1, 2, 3});
  Behavior ended = *store->local().behavior(id);
  ended.end = Stamp{9};
  ended.outcome = "success";
  ended.snapshot = R"({"files": {"file:///x.wav": ")" + sum + R"("}})";
  store->local().updateBehavior(ended);
  ASSERT_TRUE(hasArrived(1));
  EXPECT_EQ(arrived(), numbers(9));
  const auto reader = openStore(uri, OpenMode::ReadOnly);
  ASSERT_TRUE(reader->behavior(id)) << "the id is the same on the server";
  EXPECT_EQ(reader->behavior(id)->outcome, "success");
  EXPECT_EQ(reader->file(sum), (Bytes{1, 2, 3}));
  EXPECT_EQ(reader->recordings().front().robot, "fetch7");
}

TEST_F(RecorderStoreTest, whatIsDiscardedAtItsEndIsNeverSent) {
  const std::int64_t id = begin();
  append(0, 3);
  {
    const auto unsent = store->holdSending();
    end(id, 3);
    std::this_thread::sleep_for(50ms);  // ten looks
    store->local().removeBehavior(id);
  }
  const std::int64_t next = begin("place");
  append(10, 12);
  end(next, 12);
  ASSERT_TRUE(hasArrived(1));
  EXPECT_TRUE(openStore(uri, OpenMode::ReadOnly)->behavior(next));
}

TEST_F(RecorderStoreTest, aServerKilledAndRestartedLosesNothingAndDoublesNothing) {
  const std::int64_t id = begin();
  append(0, 200);
  server->kill();
  append(200, 300);
  end(id, 300);
  ASSERT_TRUE(eventually([&] { return store->status()->last_error != ""; }));
  EXPECT_EQ(store->status()->unsent, 1u);
  server->start();
  ASSERT_TRUE(hasArrived(1));
  EXPECT_EQ(arrived(), numbers(300));
  ASSERT_TRUE(eventually([&] { return store->status()->last_error == ""; }));
  EXPECT_EQ(store->status()->unsent, 0u);
}

TEST_F(RecorderStoreTest, aServerThatStallsHoldsUpNothing) {
  const std::int64_t first = begin();
  append(0, 20);
  end(first, 20);
  ASSERT_TRUE(hasArrived(1));
  server->pause();
  const std::int64_t second = begin("place");
  append(20, 40);
  end(second, 40);
  ASSERT_TRUE(eventually([&] { return store->status()->last_error != ""; }));
  server->resume();
  ASSERT_TRUE(hasArrived(2));
  const auto reader = openStore(uri, OpenMode::ReadOnly);
  EXPECT_EQ(test::readTexts(*reader, *reader->behavior(second)), numbers(40)) << "it began at 0";
  ASSERT_TRUE(eventually([&] { return store->status()->last_error == ""; }));
}

TEST_F(RecorderStoreTest, aServerThatIsAwayAtTheStartGetsEverythingLater) {
  store.reset();
  server->kill();
  open(0ms);
  const std::int64_t id = begin();
  append(0, 10);
  end(id, 10);
  ASSERT_TRUE(eventually([&] { return store->status()->unsent == 1; }));
  open(0ms);  // another recorder's run, and the server is still away
  ASSERT_TRUE(eventually([&] { return store->status()->unsent == 1; }));
  EXPECT_EQ(store->local().behavior(id)->outcome, "success");
  server->start();
  ASSERT_TRUE(hasArrived(1));
  EXPECT_EQ(arrived(), numbers(10));
  EXPECT_TRUE(openStore(uri, OpenMode::ReadOnly)->behavior(id));
}

TEST_F(RecorderStoreTest, idsThatTheServerNeverGaveCannotMeetItsOwn) {
  EXPECT_GE(begin(), std::int64_t{1} << 40);
  EXPECT_EQ(RecorderStore(folder.path("robot.db")).newBehaviorId(), 0)
      << "a store that stays on this machine gives small ones itself";
}

TEST_F(RecorderStoreTest, aBehaviorWhoseRecorderDiedIsIncomplete) {
  begin();
  append(0, 5);
  open();
  ASSERT_TRUE(hasArrived(1));
  EXPECT_EQ(arrived(), numbers(5));
  const Behavior behavior = openStore(uri, OpenMode::ReadOnly)->behaviors({}).front();
  EXPECT_EQ(behavior.outcome, kIncomplete);
  EXPECT_EQ(behavior.end, Stamp{5});
}

TEST_F(RecorderStoreTest, aChildThatEndsFirstGetsItsParentWhenThatEnds) {
  const std::int64_t tree = begin("kitting");
  const std::int64_t pick = begin("pick", tree);
  append(0, 5);
  end(pick, 5);
  ASSERT_TRUE(hasArrived(1));
  store->removeSent(kEndOfTime);
  EXPECT_TRUE(store->local().behavior(pick)) << "the server is still to be told whose child it is";
  append(5, 8);
  end(tree, 8);
  ASSERT_TRUE(eventually([&] {
    const auto child = openStore(uri, OpenMode::ReadOnly)->behavior(pick);
    return child && child->parent == tree;
  }));
}

TEST_F(RecorderStoreTest, whatTheServerHasIsRemovedHereOnceNobodyReachesBackIntoIt) {
  const std::int64_t id = begin();
  append(0, 5);
  end(id, 5);
  ASSERT_TRUE(hasArrived(1));
  ASSERT_TRUE(eventually([&] { return store->status()->unsent == 0; }));
  store->removeSent(Stamp{5});
  EXPECT_TRUE(store->local().behavior(id));
  const std::int64_t open_one = begin("place");
  store->removeSent(Stamp{6});
  EXPECT_FALSE(store->local().behavior(id));
  EXPECT_TRUE(store->local().behavior(open_one));
  EXPECT_EQ(arrived(), numbers(5)) << "there it stays";
}

/// The server of these tests makes SQL of names and takes no quotes in them.
TEST_F(RecorderStoreTest, whatTheServerRefusesHoldsUpNothing) {
  const std::int64_t id = begin();
  const auto quoted = store->local().addChannel(recording, stringChannel("/it's"));
  append(0, 2);
  store->local().append(
      {stringMessage(quoted, 2, 2, "quoted"), stringMessage(channel, 3, 3, "2")});
  store->local().append({stringMessage(channel, 4, 4, "3")});
  end(id, 5);
  const std::int64_t next = begin("place");
  end(next, 1);
  ASSERT_TRUE(hasArrived(2));
  const auto reader = openStore(uri, OpenMode::ReadOnly);
  EXPECT_EQ(test::readTexts(*reader, *reader->behavior(id)), numbers(4));
  const SendStatus status = *store->finish();
  EXPECT_EQ(status.unsent, 0u);
  EXPECT_EQ(status.refused, 1u);
  EXPECT_EQ(status.last_refusal.rfind(
                "behavior " + std::to_string(id) + ": a message on /it's: mongodb://", 0),
            0u)
      << status.last_refusal;
  EXPECT_NE(status.last_refusal.find("takes no quotes"), std::string::npos) << status.last_refusal;
  EXPECT_EQ(status.path, folder.path("spool.db"));
  open();
  ASSERT_TRUE(eventually([&] { return store->status()->refused == 1; }))
      << "it was tried again, and is not lost";
  store->removeSent(kEndOfTime);
  EXPECT_TRUE(store->local().behavior(id));
}

TEST_F(RecorderStoreTest, aMessageThatWasDamagedHereIsLeftOutAndThatIsSaid) {
  const std::int64_t id = begin();
  append(0, 3);
  SqliteConnection(folder.path("spool.db"), SqliteAccess::ReadWriteCreate)
      .execute("UPDATE messages SET bytes = zeroblob(size) WHERE sequence = 1");
  end(id, 3);
  ASSERT_TRUE(hasArrived(1));
  EXPECT_EQ(arrived(), (std::vector<std::string>{"0", "2"}));
  ASSERT_TRUE(eventually([&] { return store->status()->refused == 1; }));
  EXPECT_EQ(store->status()->last_refusal,
            "behavior " + std::to_string(id) + ": damaged messages were left out");
}

TEST_F(RecorderStoreTest, aBehaviorThatTheServerCannotTakeHoldsUpNothing) {
  const std::int64_t id = begin();
  const auto there = openStore(uri, OpenMode::ReadWrite);
  Behavior other = sampleBehavior(there->addRecording({0, "", "other", ""}), {}, 0, 1);
  other.id = id;
  there->addBehavior(other);
  end(id, 1);
  const std::int64_t next = begin("place");
  end(next, 1);
  ASSERT_TRUE(eventually([&] { return store->status()->refused == 1; }));
  EXPECT_NE(store->status()->last_refusal.find(" is there already"), std::string::npos)
      << store->status()->last_refusal;
  ASSERT_TRUE(hasArrived(2));
  EXPECT_TRUE(there->behavior(next));
}

TEST_F(RecorderStoreTest, theServerIsTendedOnceBehindWhatWasSent) {
  std::atomic<int> tended{0};
  std::atomic<std::size_t> had{0};
  const std::int64_t id = begin();
  end(id, 1);
  ASSERT_TRUE(hasArrived(1));
  store->tend([&](Store& given) {
    had = given.behaviors({}).size();
    ++tended;
  });
  ASSERT_TRUE(eventually([&] { return tended > 0; }));
  EXPECT_EQ(had, 1u);
  store->finish();
  EXPECT_EQ(tended, 1);
}

TEST_F(RecorderStoreTest, theEndTellsWhatWaits) {
  open(300ms);
  const std::int64_t id = begin();
  server->kill();
  append(0, 3);
  end(id, 3);
  const SendStatus status = *store->finish();
  EXPECT_EQ(status.unsent, 1u);
  EXPECT_EQ(status.path, folder.path("spool.db"));
}

TEST_F(RecorderStoreTest, oneRecorderAtATimeHasTheFile) {
  EXPECT_THROW(RecorderStore(uri, SendOptions{folder.path("spool.db")}), StoreError);
}

// --------------------------------------------------------------------------- the recorder's file

TEST(RecorderFile, isNamedByTheServerWithoutWhatMayChangeOfItsUri) {
  setenv("AFTERGLOW_SPOOL", "/spool", 1);
  const std::string file = recorderFile("mongodb://host/fleet");
  EXPECT_EQ(file.rfind("/spool/spool-", 0), 0u) << file;
  EXPECT_EQ(file.size(), std::string("/spool/spool-0123456789abcdef.db").size());
  EXPECT_EQ(recorderFile("mongodb://robot:secret@host/fleet?tls=true"), file);
  EXPECT_NE(recorderFile("mongodb://host/other"), file);
  setenv("AFTERGLOW_SPOOL", "", 1);
  setenv("HOME", "/home/somebody", 1);
  EXPECT_EQ(recorderFile("mongodb://host/fleet"),
            "/home/somebody/.local/share/afterglow" + file.substr(6));
  unsetenv("AFTERGLOW_SPOOL");
}

TEST(RecorderFile, liesWhereTheEnvironmentSaysThoughItsServerIsAway) {
  const test::TempFolder folder;
  setenv("AFTERGLOW_SPOOL", folder.path("spool").c_str(), 1);
  const std::string uri = "mongodb://127.0.0.1:1/d?serverSelectionTimeoutMS=50";
  RecorderStore store(uri);
  EXPECT_EQ(store.status()->path, recorderFile(uri));
  EXPECT_TRUE(std::filesystem::exists(recorderFile(uri)));
  unsetenv("AFTERGLOW_SPOOL");
}

TEST(RecorderFile, isTendedAtOnceWhereThereIsNoServer) {
  const test::TempFolder folder;
  RecorderStore store(folder.path("robot.db"));
  const Store* tended = nullptr;
  store.tend([&](Store& given) { tended = &given; });
  EXPECT_EQ(tended, &store.local());
  EXPECT_FALSE(store.finish());
  const std::int64_t recording = store.local().addRecording({0, "", "test", ""});
  Behavior ended = sampleBehavior(recording, {}, 0, 1);
  const std::int64_t id = store.local().addBehavior(ended);
  store.removeSent(kEndOfTime);
  EXPECT_TRUE(store.local().behavior(id)) << "nobody else has it";
}

/// A spool of version 1.
class OldSpool : public testing::Test {
 protected:
  enum Kind { Messages = 0, State = 1, File = 3 };

  void SetUp() override {
    SqliteConnection spool(path_, SqliteAccess::ReadWriteCreate);
    spool.execute(R"(
        PRAGMA journal_mode = WAL;
        CREATE TABLE outbox (id INTEGER PRIMARY KEY AUTOINCREMENT, kind INTEGER NOT NULL,
          messages INTEGER NOT NULL, payload BLOB NOT NULL);
        CREATE TABLE recordings (id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE,
          source TEXT NOT NULL, robot TEXT NOT NULL, last_ns INTEGER);
        CREATE TABLE channels (id INTEGER PRIMARY KEY, recording INTEGER NOT NULL,
          topic TEXT NOT NULL, type TEXT NOT NULL, md5 TEXT NOT NULL, definition TEXT NOT NULL,
          latching INTEGER NOT NULL, caller_id TEXT NOT NULL);
        CREATE TABLE behaviors (id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE,
          is_open INTEGER NOT NULL, state BLOB NOT NULL);
        INSERT INTO recordings VALUES (7, 'the key', 'recorder', 'fetch7', 30);
        INSERT INTO channels VALUES (9, 7, '/a', 'std_msgs/String', 'm', 'string data', 1, '/b');)");
    put(spool, "outbox", Messages, packed(10, std::nullopt, "a") + packed(12, Stamp{11}, "b"));
    put(spool, "outbox", State, "as behaviors has it");
    put(spool, "outbox", File, number<std::uint64_t>(64) + std::string(64, 'c') + "contents");
    addBehavior(spool, 5, Stamp{20});
    addBehavior(spool, 6, {});
  }

  template <typename T>
  static std::string number(T value) {
    return {reinterpret_cast<const char*>(&value), sizeof value};
  }
  static std::string packed(std::int64_t received_ns, std::optional<Stamp> header,
                            const std::string& text, std::int64_t channel = 9) {
    const Bytes bytes = test::stringBytes(text);
    return number(channel) + number(received_ns) + number<std::uint64_t>(received_ns) +
           number<std::uint8_t>(header ? 1 : 0) + number(header.value_or(Stamp{}).ns) +
           number<std::uint64_t>(bytes.size()) + std::string(bytes.begin(), bytes.end());
  }
  static void put(SqliteConnection& spool, const std::string& table, Kind kind,
                  const std::string& payload) {
    SqliteStatement(spool, "INSERT INTO " + table + " (kind, messages, payload) VALUES (?1, 1, ?2)")
        .bind(1, std::int64_t{kind})
        .bind(2, Bytes(payload.begin(), payload.end()))
        .run();
  }
  static void addBehavior(SqliteConnection& spool, std::int64_t id, std::optional<Stamp> end) {
    Behavior behavior = sampleBehavior(7, {"/a"}, 10, 0);
    behavior.id = id;
    behavior.key = "key " + std::to_string(id);
    behavior.end = end;
    if (end) behavior.outcome = "success";
    const Bson state = toMongo(behavior);
    const std::uint8_t* bytes = bson_get_data(&state.raw());
    SqliteStatement(spool, "INSERT INTO behaviors VALUES (?1, ?2, ?3, ?4)")
        .bind(1, id)
        .bind(2, behavior.key)
        .bind(3, std::int64_t{end ? 0 : 1})
        .bind(4, Bytes(bytes, bytes + state.size()))
        .run();
  }
  std::string errorOfConversion() const {
    try {
      convertSpool(path_);
    } catch (const StoreError& error) {
      return error.what();
    }
    return "";
  }

  test::TempFolder folder_;
  std::string path_ = folder_.path("spool.db");
};

TEST_F(OldSpool, becomesAStoreWithAllThatItHeld) {
  {
    SqliteConnection spool(path_, SqliteAccess::ReadWriteCreate);
    spool.execute(
        "CREATE TABLE refused (id INTEGER PRIMARY KEY, kind INTEGER NOT NULL, "
        "messages INTEGER NOT NULL, payload BLOB NOT NULL, why TEXT)");
    put(spool, "refused", Messages, packed(15, std::nullopt, "refused"));
  }
  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(errorOfConversion(), "");
    EXPECT_FALSE(std::filesystem::exists(path_ + ".old"));
    const auto store = openStore(path_, OpenMode::ReadOnly);
    const Behavior ended = store->behavior(5).value(), died = store->behavior(6).value();
    EXPECT_EQ(test::readTexts(*store, ended), (std::vector<std::string>{"a", "b", "refused"}));
    EXPECT_EQ(ended.outcome, "success");
    EXPECT_EQ(died.outcome, kIncomplete);
    EXPECT_EQ(died.end, Stamp{31}) << "behind the last message of its recording";
    EXPECT_EQ(store->recordings().at(0).robot, "fetch7");
    EXPECT_EQ(store->recordings().at(0).key, "the key");
    const auto messages = test::readAll(*store->messages(ended, {}));
    EXPECT_FALSE(messages.at(0).header_stamp);
    EXPECT_EQ(messages.at(1).header_stamp, Stamp{11});
    EXPECT_TRUE(store->channel(messages.at(0).channel).latching);
    EXPECT_EQ(store->file(std::string(64, 'c')), (Bytes{'c', 'o', 'n', 't', 'e', 'n', 't', 's'}));
  }
}

TEST_F(OldSpool, endsWhatRanAtItsBeginWhereNothingWasHeard) {
  SqliteConnection(path_, SqliteAccess::ReadWriteCreate)
      .execute("UPDATE recordings SET last_ns = NULL");
  EXPECT_EQ(errorOfConversion(), "");
  EXPECT_EQ(openStore(path_, OpenMode::ReadOnly)->behavior(6)->end, Stamp{10});
}

TEST_F(OldSpool, isGoneOnWithWhereItsConversionBrokeOff) {
  {
    SqliteConnection(path_, SqliteAccess::ReadWriteCreate)
        .execute("UPDATE behaviors SET state = x'05' WHERE id = 6");
  }
  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(errorOfConversion(), "the spool is damaged: a behavior is no BSON");
    EXPECT_TRUE(std::filesystem::exists(path_ + ".old")) << "nothing of it is lost";
  }
  SqliteConnection(path_ + ".old", SqliteAccess::ReadWriteCreate)
      .execute("DELETE FROM behaviors WHERE id = 6");
  EXPECT_EQ(errorOfConversion(), "");
  const auto store = openStore(path_, OpenMode::ReadOnly);
  EXPECT_EQ(test::readTexts(*store, store->behavior(5).value()),
            (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(store->behaviors({}).size(), 1u);
}

TEST_F(OldSpool, isRefusedWhereItIsDamaged) {
  const std::string whole = packed(16, std::nullopt, "whole"), of_another = packed(16, {}, "x", 99);
  const std::pair<std::string, const char*> entries[] = {
      {whole.substr(0, whole.size() - 1), "an entry is cut off"},
      {whole.substr(0, 5), "an entry is cut off"},
      {of_another, "channel 99 is missing"}};
  for (const auto& [entry, why] : entries) {
    {
      SqliteConnection spool(path_, SqliteAccess::ReadWriteCreate);
      spool.execute("DELETE FROM outbox");
      put(spool, "outbox", Messages, entry);
    }
    EXPECT_EQ(errorOfConversion(), std::string("the spool is damaged: ") + why);
    std::filesystem::rename(path_ + ".old", path_);
  }
}

}  // namespace
}  // namespace afterglow::replay::recorder_store_test

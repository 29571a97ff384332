// Checking, repairing, measuring and pruning a store; older versions.
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include "replay/store/behavior_edit.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"
#include "replay/store/sqlite/sqlite_store.hpp"
#include "replay/store/sqlite/store_care.hpp"
#include "tests/support/faulty_store.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::store_care_test {
namespace {

namespace fs = std::filesystem;
using namespace afterglow::test;
using Texts = std::vector<std::string>;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// Ten behaviors of ten seconds with a hundred messages each, on /a and /b in turn.
class StoreCare : public testing::Test {
 protected:
  void SetUp() override {
    const auto store = openStore(path_, OpenMode::ReadWrite);
    const auto recording = store->addRecording({0, "", "/recorder", "fetch21"});
    const auto a = store->addChannel(recording, stringChannel("/a"));
    const auto b = store->addChannel(recording, stringChannel("/b"));
    store->transaction([&] {
      for (std::int64_t i = 0; i < 10; ++i) {
        const std::int64_t begin_ns = i * 10 * kSecond_ns;
        Behavior behavior =
            sampleBehavior(recording, {"/a", "/b"}, begin_ns, begin_ns + 10 * kSecond_ns);
        if (i == 3) behavior.tags = {"keep"};
        store->addBehavior(behavior);
        std::vector<Message> batch;
        for (std::int64_t k = 0; k < 100; ++k) {
          const std::int64_t at_ns = begin_ns + k * kSecond_ns / 10;
          batch.push_back(stringMessage(k % 2 ? b : a, at_ns,
                                        static_cast<std::uint64_t>(100 * i + k),
                                        std::string(1000, static_cast<char>('a' + i))));
        }
        store->append(batch);
      }
    });
  }

  void sql(const std::string& text) {
    SqliteConnection(path_, SqliteAccess::ReadWriteCreate).execute(text);
  }
  std::int64_t number(const std::string& text) {
    return SqliteConnection(path_, SqliteAccess::ReadOnly).integer(text);
  }
  /// Overwrites the page on which a b-tree's row lies, and the two behind it; the store must be
  /// closed.
  void damagePagesFrom(const std::string& text) {
    std::string bytes = fileBytes(path_);
    const auto at = bytes.find(text);
    ASSERT_NE(at, std::string::npos);
    for (std::size_t page = at / 16384; page < at / 16384 + 3; ++page) {
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(page * 16384), 200, '\x55');
    }
    writeFile(path_, bytes);
  }
  std::size_t readable() {
    const auto store = openStore(path_, OpenMode::ReadOnly);
    std::size_t count = 0;
    for (const auto& behavior : store->behaviors({})) {
      count += readAll(*store->messages(behavior, {})).size();
    }
    return count;
  }

  TempFolder folder_;
  std::string path_ = folder_.path("store.db");
};

// ------------------------------------------------------------------------------ check and repair

TEST_F(StoreCare, findsNothingInAWholeStore) {
  std::uint64_t last = 0;
  const auto check = checkStore(path_, [&](std::uint64_t done, std::uint64_t) { last = done; });
  EXPECT_EQ(check.problems, Texts{});
  EXPECT_EQ(check.messages, 1000u);
  EXPECT_EQ(last, 1000u);
}

TEST_F(StoreCare, namesDamageByTopicAndTime) {
  sql("UPDATE messages SET bytes = zeroblob(size) WHERE sequence IN (3, 5, 11)");
  sql("UPDATE behaviors SET tags = '[', parent = 77 WHERE id = 2");
  sql("DELETE FROM behavior_counts WHERE behavior = 4");
  sql("UPDATE channels SET definition = 9 WHERE topic = '/a'");
  sql("INSERT INTO files VALUES ('" + std::string(64, '0') + "', x'00')");
  EXPECT_EQ(
      checkStore(path_).problems,
      (Texts{"channels: 1 refer to definitions that are not there",
             "recording 1, /b: 3 messages are damaged, from 1970-01-01T00:00:00.300Z to "
             "1970-01-01T00:00:01.100Z: the checksum is another",
             "behavior 2 (pick): its parent is not there", "behavior 2 (pick): tags is not JSON",
             "behavior 4 (pick): its messages are not as many as were counted",
             "the file of SHA-256 " + std::string(64, '0') + " has another"}));
}

TEST_F(StoreCare, namesAChannelByItsNumberWhereItsRowIsLost) {
  sql("UPDATE messages SET bytes = zeroblob(size) WHERE sequence = 3");
  sql("DELETE FROM channels WHERE topic = '/b'");
  const Texts problems = checkStore(path_).problems;
  EXPECT_NE(std::find(problems.begin(), problems.end(),
                      "channel 2: a message is damaged, of 1970-01-01T00:00:00.300Z: the checksum "
                      "is another"),
            problems.end());
}

/// What is taken away from a folder, or out of it.
class FolderChanges {
 public:
  explicit FolderChanges(const std::string& folder) : file_(inotify_init1(IN_NONBLOCK)) {
    inotify_add_watch(file_, folder.c_str(), IN_MOVED_FROM | IN_DELETE);
  }
  ~FolderChanges() { ::close(file_); }
  std::set<std::string> gone() {
    std::set<std::string> names;
    alignas(inotify_event) std::array<char, 65536> buffer{};
    const auto size = ::read(file_, buffer.data(), buffer.size());
    for (ssize_t at = 0; at < size;) {
      const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
      if (event->len > 0) names.insert(event->name);
      at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
    }
    return names;
  }

 private:
  int file_;
};

TEST_F(StoreCare, isThereAtEveryMomentOfARepair) {
  fs::permissions(path_, fs::perms(0640));
  FolderChanges changes(fs::path(path_).parent_path());
  repairStore(path_);
  EXPECT_EQ(changes.gone().count(fs::path(path_).filename()), 0u)
      << "a recorder that starts just then would begin an empty store";
  EXPECT_EQ(fs::status(path_).permissions(), fs::perms(0640));
  EXPECT_EQ(openStore(path_, OpenMode::ReadOnly)->behaviors({}).size(), 10u);
  EXPECT_EQ(openStore(path_ + ".damaged", OpenMode::ReadOnly)->behaviors({}).size(), 10u);
}

TEST_F(StoreCare, repairsAWholeStoreWithoutLoss) {
  const auto repair = repairStore(path_);
  EXPECT_EQ(repair.lost, Texts{});
  EXPECT_EQ(repair.messages, 1000u);
  EXPECT_EQ(repair.damaged_path, path_ + ".damaged");
  EXPECT_EQ(checkStore(path_).problems, Texts{});
  EXPECT_EQ(readable(), 1000u);
  EXPECT_EQ(checkStore(path_ + ".damaged").problems, Texts{});
  EXPECT_EQ(repairStore(path_).damaged_path, path_ + ".damaged.2");
}

TEST_F(StoreCare, savesWhatLiesAroundDamagedPages) {
  damagePagesFrom(std::string(500, 'f'));
  EXPECT_FALSE(checkStore(path_).problems.empty());
  const std::size_t before = readable();
  EXPECT_LT(before, 1000u) << "and more than nothing: the index leads around the damage";
  EXPECT_GT(before, 900u);
  try {
    openStore(path_, OpenMode::Record);
    ADD_FAILURE() << "recorded into";
  } catch (const StoreError& error) {
    EXPECT_NE(std::string(error.what()).find("\"afterglow store repair --store " + path_),
              std::string::npos)
        << error.what();
  }
  const auto repair = repairStore(path_);
  EXPECT_EQ(repair.messages, before);
  ASSERT_EQ(repair.lost.size(), 2u);
  EXPECT_EQ(repair.lost[0].rfind("recording 1, /a: ", 0), 0u) << repair.lost[0];
  EXPECT_NE(repair.lost[0].find(" messages are lost, from 1970-01-01T00:00:"), std::string::npos);
  EXPECT_EQ(checkStore(path_).problems, Texts{});
  EXPECT_EQ(readable(), before);
}

TEST_F(StoreCare, leavesDamagedMessagesOutOfARepair) {
  sql("UPDATE messages SET bytes = zeroblob(size) WHERE sequence = 3");
  const auto repair = repairStore(path_);
  EXPECT_EQ(repair.messages, 999u);
  EXPECT_EQ(repair.lost, (Texts{"recording 1, /b: a message is lost, of 1970-01-01T00:00:00.300Z: "
                                "the checksum is another"}));
  EXPECT_EQ(checkStore(path_).problems, Texts{});
}

TEST_F(StoreCare, keepsLargeMessagesInARepairAndLeavesOutDamagedOnes) {
  const std::string large(9'000'000, 'x');
  openStore(path_, OpenMode::ReadWrite)
      ->append({stringMessage(1, 98 * kSecond_ns, 5000, large),
                stringMessage(2, 99 * kSecond_ns, 5001, large)});
  ASSERT_EQ(number("SELECT count(*) FROM chunks WHERE message > 1000"), 6);
  sql("DELETE FROM chunks WHERE number = 1 AND message = "
      "(SELECT id FROM messages WHERE sequence = 5001)");
  const auto repair = repairStore(path_);
  EXPECT_EQ(repair.messages, 1001u);
  EXPECT_EQ(repair.lost, (Texts{"recording 1, /b: a message is lost, of 1970-01-01T00:01:39.000Z: "
                                "chunk 1 is missing"}));
  EXPECT_EQ(checkStore(path_).problems, Texts{});
  const auto store = openStore(path_, OpenMode::ReadOnly);
  const Behavior last = store->behaviors({}).front();
  const auto messages = readAll(*store->messages(last, {{}, Stamp{98 * kSecond_ns}}));
  EXPECT_EQ(std::count_if(messages.begin(), messages.end(),
                          [&](const Message& message) { return textOf(message) == large; }),
            1);
}

TEST_F(StoreCare, tellsHowFarARepairIs) {
  std::vector<Message> many;
  for (std::uint64_t i = 0; i < 3500; ++i) many.push_back(stringMessage(1, 5, 5000 + i, "x"));
  openStore(path_, OpenMode::ReadWrite)->append(many);
  std::vector<std::uint64_t> told;
  const auto repair =
      repairStore(path_, [&](std::uint64_t done, std::uint64_t) { told.push_back(done); });
  EXPECT_EQ(told, (std::vector<std::uint64_t>{2000, 4000}));
  EXPECT_EQ(repair.messages, 4500u);
  EXPECT_EQ(number("SELECT count(*) FROM messages"), 4500);
}

TEST_F(StoreCare, countsDeadImportsAndKeepsThemInARepairForWhoDropsThem) {
  {
    const auto dying = openStore(path_, OpenMode::ReadWrite);
    const std::int64_t import = dying->beginImport({0, "", "a.bag", ""});
    const std::int64_t channel = dying->addChannel(import, stringChannel("/imported"));
    dying->append({stringMessage(channel, 1, 0, "x")});
    EXPECT_EQ(checkStore(path_).dead_imports, 0u) << "its program lives";
  }
  EXPECT_EQ(checkStore(path_).dead_imports, 1u);
  EXPECT_EQ(repairStore(path_).lost, Texts{});
  EXPECT_EQ(checkStore(path_).dead_imports, 1u);
  EXPECT_EQ(openStore(path_, OpenMode::ReadWrite)->dropUnfinished(), 1u);
  EXPECT_EQ(checkStore(path_).dead_imports, 0u);
  EXPECT_EQ(number("SELECT count(*) FROM messages"), 1000);
}

TEST_F(StoreCare, savesWhatReferencesWereLostOf) {
  sql("DELETE FROM recordings");
  sql("DELETE FROM channels WHERE topic = '/b'");
  sql("DELETE FROM definitions; INSERT INTO definitions VALUES (1, 'std_msgs/String', 'x', '')");
  const auto repair = repairStore(path_);
  EXPECT_EQ(repair.messages, 500u) << "those of /a";
  EXPECT_EQ(repair.lost, Texts{"where 1 recordings come from"});
  EXPECT_EQ(checkStore(path_).problems, Texts{});
  EXPECT_EQ(readable(), 500u);
  const auto recordings = openStore(path_, OpenMode::ReadOnly)->recordings();
  ASSERT_EQ(recordings.size(), 1u);
  EXPECT_EQ(recordings[0].key.size(), 32u);
}

TEST_F(StoreCare, repairsNothingThatIsNotThere) {
  const std::string path = folder_.path("none.db");
  try {
    repairStore(path);
    FAIL() << "repaired";
  } catch (const StoreError& error) {
    EXPECT_EQ(std::string(error.what()), "sqlite:" + path + ": no such store");
  }
  EXPECT_FALSE(fs::exists(path));
}

TEST_F(StoreCare, leavesAStoreAloneThatIsNoneOrCannotBePutInItsPlace) {
  const std::string other = folder_.path("notes.txt");
  writeFile(other, std::string(5000, 'x'));
  EXPECT_THROW(repairStore(other), StoreError);
  EXPECT_EQ(fileBytes(other), std::string(5000, 'x'));
  EXPECT_FALSE(fs::exists(other + ".repaired"));
  fs::create_symlink(folder_.path("nowhere"), path_ + ".damaged");
  try {
    repairStore(path_);
    FAIL() << "its old file had no name to go to";
  } catch (const StoreError& error) {
    EXPECT_NE(
        std::string(error.what()).find("cannot put the repaired store " + path_ + ".repaired"),
        std::string::npos)
        << error.what();
  }
  EXPECT_EQ(readable(), 1000u);
}

TEST_F(StoreCare, editsNoBehaviorWhoseSnapshotIsDamaged) {
  sql("UPDATE behaviors SET snapshot = '[' WHERE id = 2");
  const auto store = openStore(path_, OpenMode::ReadWrite);
  BehaviorEdit edit;
  edit.notes = {"the gripper slipped"};
  try {
    editBehavior(*store, 2, edit);
    FAIL() << "edited";
  } catch (const StoreError& error) {
    EXPECT_STREQ(error.what(), "behavior 2: its snapshot is no JSON object");
  }
}

TEST_F(StoreCare, repairsNothingThatIsBeingRecorded) {
  const auto recorder = openStore(path_, OpenMode::Record);
  EXPECT_THROW(repairStore(path_), StoreError);
  EXPECT_THROW(openStore(path_, OpenMode::ReadWrite)->compact(), StoreError);
}

// ------------------------------------------------------------------------------- stats and pruning

TEST_F(StoreCare, measures) {
  const StoreStats stats = storeStats(path_);
  EXPECT_EQ(stats.recordings, 1u);
  EXPECT_EQ(stats.behaviors, 10u);
  EXPECT_EQ(stats.messages, 1000u);
  EXPECT_EQ(stats.oldest, Stamp{0});
  EXPECT_EQ(stats.newest, Stamp{99 * kSecond_ns + 900'000'000});
  ASSERT_EQ(stats.topics.size(), 2u);
  EXPECT_EQ(stats.topics[0].topic, "/a");
  EXPECT_EQ(stats.topics[0].bytes, 500u * 1004u);
  ASSERT_EQ(stats.largest.size(), 10u);
  EXPECT_EQ(stats.largest[0].bytes, 100u * 1004u);
  EXPECT_GE(stats.file_bytes, 1'000'000u);
  EXPECT_FALSE(stats.recorder);
}

std::vector<std::int64_t> idsOf(const std::vector<Behavior>& behaviors) {
  std::vector<std::int64_t> ids;
  for (const auto& behavior : behaviors) ids.push_back(behavior.id);
  return ids;
}

TEST_F(StoreCare, removesWhatIsOldButNotWhatIsTaggedOrRuns) {
  const auto store = openStore(path_, OpenMode::ReadWrite);
  Behavior open = sampleBehavior(1, {"/a"}, 5 * kSecond_ns, 0);
  open.end.reset();
  const auto running = store->addBehavior(open);
  RetentionPolicy policy;
  policy.ended_before = Stamp{50 * kSecond_ns};
  policy.keep_tags = {"keep"};
  const std::vector<std::int64_t> expected{1, 2, 3};
  EXPECT_EQ(idsOf(pruneWould(*store, policy)), expected);
  EXPECT_EQ(store->behaviors({}).size(), 11u);
  EXPECT_EQ(idsOf(prune(*store, policy)), expected);
  EXPECT_TRUE(store->behavior(running));
  EXPECT_TRUE(store->behavior(4)) << "its tag";
  EXPECT_EQ(number("SELECT count(*) FROM messages"), 950) << "the running one covers the rest";
}

TEST_F(StoreCare, removesTheOldestUntilTheStoreIsSmallEnough) {
  const auto store = openStore(path_, OpenMode::ReadWrite);
  RetentionPolicy policy;
  policy.most_bytes = *store->usedBytes() * 6 / 10;
  const auto would = idsOf(pruneWould(*store, policy));
  EXPECT_GT(would.size(), 3u);
  EXPECT_LT(would.size(), 8u);
  EXPECT_EQ(idsOf(prune(*store, policy)), would);
  EXPECT_LE(*store->usedBytes(), *policy.most_bytes);
  const auto size = fs::file_size(path_);
  store->compact();
  EXPECT_LT(fs::file_size(path_), size);
  EXPECT_EQ(checkStore(path_).problems, Texts{});
}

TEST_F(StoreCare, namesEachBehaviorThatIsRemovedAsItGoes) {
  const auto store = openStore(path_, OpenMode::ReadWrite);
  RetentionPolicy policy;
  policy.ended_before = Stamp{30 * kSecond_ns};
  std::vector<std::int64_t> named;
  const auto gone = prune(*store, policy, [&](const Behavior& behavior) {
    EXPECT_FALSE(store->behavior(behavior.id));
    named.push_back(behavior.id);
  });
  EXPECT_EQ(named, (std::vector<std::int64_t>{1, 2}));
  EXPECT_EQ(idsOf(gone), named);
}

TEST_F(StoreCare, removesNothingBySizeWhereTheStoreDoesNotKnowIts) {
  FaultyStore store;
  RetentionPolicy policy;
  policy.most_bytes = 0;
  EXPECT_THROW(prune(store, policy), StoreError);
}

TEST_F(StoreCare, forgetsARecordingsMessagesWithItsLastBehavior) {
  const auto store = openStore(path_, OpenMode::ReadWrite);
  store->append({stringMessage(1, -5 * kSecond_ns, 5000, "before all behaviors")});
  RetentionPolicy policy;
  policy.most_bytes = 0;
  EXPECT_EQ(prune(*store, policy).size(), 10u);
  EXPECT_EQ(number("SELECT count(*) FROM messages"), 0);
}

// --------------------------------------------------------------------------------- older versions

/// A store of version 1, as its program made it.
constexpr const char* kVersion1 = R"(
CREATE TABLE definitions (
  id INTEGER PRIMARY KEY, type TEXT NOT NULL, md5 TEXT NOT NULL, text TEXT NOT NULL);
CREATE INDEX definitions_by_md5 ON definitions (md5);
CREATE TABLE recordings (id INTEGER PRIMARY KEY, source TEXT NOT NULL);
CREATE TABLE channels (
  id INTEGER PRIMARY KEY,
  recording INTEGER NOT NULL REFERENCES recordings,
  topic TEXT NOT NULL,
  definition INTEGER NOT NULL REFERENCES definitions,
  latching INTEGER NOT NULL,
  caller_id TEXT NOT NULL,
  UNIQUE (recording, topic, definition, latching, caller_id));
CREATE TABLE messages (
  id INTEGER PRIMARY KEY,
  recording INTEGER NOT NULL REFERENCES recordings,
  channel INTEGER NOT NULL REFERENCES channels,
  received_ns INTEGER NOT NULL,
  sequence INTEGER NOT NULL,
  header_stamp_ns INTEGER,
  document TEXT,
  bytes BLOB NOT NULL);
CREATE UNIQUE INDEX messages_in_order ON messages (recording, received_ns, sequence, channel);
CREATE TABLE behaviors (
  id INTEGER PRIMARY KEY,
  recording INTEGER NOT NULL REFERENCES recordings,
  name TEXT NOT NULL,
  tree_path TEXT NOT NULL,
  parent INTEGER NOT NULL,
  attempt INTEGER NOT NULL,
  outcome TEXT NOT NULL,
  begin_ns INTEGER NOT NULL,
  end_ns INTEGER,
  robot TEXT NOT NULL,
  parameters TEXT NOT NULL,
  tags TEXT NOT NULL,
  calibration TEXT NOT NULL,
  topics TEXT NOT NULL);
CREATE INDEX behaviors_by_begin ON behaviors (begin_ns);
INSERT INTO definitions VALUES
  (1, 'std_msgs/String', '992ce8a1687cec8c8bd883ec73ca41d1', 'string data' || char(10));
INSERT INTO recordings VALUES (1, '/recorder');
INSERT INTO channels VALUES (1, 1, '/a', 1, 1, '/talker');
INSERT INTO messages VALUES (1, 1, 1, 10, 0, -5, '{"data":"hi"}', x'020000006869');
INSERT INTO messages VALUES (2, 1, 1, 11, 1, NULL, NULL, zeroblob(9000000));
INSERT INTO behaviors VALUES (3, 1, 'pick', 'kitting/pick', 0, 2, 'success', 10, 20, 'fetch21',
  '{"object":"gear"}', '["demo"]', '{}', '["/a"]');
INSERT INTO behaviors VALUES
  (4, 1, 'place', '', 0, 1, '', 11, NULL, 'fetch21', '{}', '[]', '{}', '["/a"]');
PRAGMA application_id = 0x4167776c;
PRAGMA user_version = 1;
PRAGMA journal_mode = WAL;
)";

TEST(OlderStore, isMadeCurrentWhenItIsOpenedForWriting) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  SqliteConnection(path, SqliteAccess::ReadWriteCreate).execute(kVersion1);
  try {
    openStore(path, OpenMode::ReadOnly);
    ADD_FAILURE() << "read as it is";
  } catch (const StoreError& error) {
    EXPECT_EQ(std::string(error.what()),
              "sqlite:" + path + ": the store has version 1; \"afterglow store compact --store " +
                  path + "\" makes it one of version 3");
  }
  openStore(path, OpenMode::ReadWrite);
  EXPECT_EQ(checkStore(path).problems, Texts{});
  const auto store = openStore(path, OpenMode::ReadOnly);
  const Recording recording = store->recordings().at(0);
  EXPECT_EQ(recording.source, "/recorder");
  EXPECT_EQ(recording.robot, "fetch21");
  EXPECT_EQ(recording.key.size(), 32u);
  const Behavior pick = *store->behavior(3);
  EXPECT_EQ(pick.name, "pick");
  EXPECT_EQ(pick.tree_path, "kitting/pick");
  EXPECT_EQ(pick.attempt, 2);
  EXPECT_EQ(pick.end, Stamp{20});
  EXPECT_EQ(pick.key.size(), 32u);
  EXPECT_EQ(pick.parameters, R"({"object":"gear"})");
  EXPECT_EQ(pick.tags, Texts{"demo"});
  EXPECT_EQ(store->behavior(4)->outcome, kIncomplete);
  EXPECT_EQ(store->topics(pick).at(0).count, 2u);
  const auto cursor = store->messages(pick, {});
  const auto messages = readAll(*cursor);
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(textOf(messages[0]), "hi");
  EXPECT_EQ(messages[0].header_stamp, Stamp{-5});
  EXPECT_TRUE(messages[1].bytes == Bytes(9'000'000, 0));
  EXPECT_TRUE(cursor->damaged().empty());
  EXPECT_EQ(SqliteConnection(path, SqliteAccess::ReadOnly)
                .integer("SELECT count(*) FROM sqlite_schema WHERE name LIKE 'old_%'"),
            0);
}

TEST(OlderStore, staysAsItIsWhenItCannotBeMadeCurrent) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  SqliteConnection(path, SqliteAccess::ReadWriteCreate).execute(kVersion1);
  SqliteConnection(path, SqliteAccess::ReadWriteCreate).execute("DROP TABLE behaviors");
  EXPECT_THROW(openStore(path, OpenMode::ReadWrite), StoreError);
  SqliteConnection connection(path, SqliteAccess::ReadOnly);
  EXPECT_EQ(connection.integer("PRAGMA user_version"), 1);
  EXPECT_EQ(connection.integer("SELECT count(*) FROM messages"), 2);
}

TEST(StoreSafety, refusesStoresWithProgramsInThem) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  openStore(path, OpenMode::ReadWrite);
  SqliteConnection(path, SqliteAccess::ReadWriteCreate)
      .execute("CREATE TRIGGER spy AFTER INSERT ON messages BEGIN SELECT 1; END");
  try {
    openStore(path, OpenMode::ReadOnly);
    ADD_FAILURE() << "opened";
  } catch (const StoreError& error) {
    EXPECT_EQ(std::string(error.what()),
              "sqlite:" + path + ": not an Afterglow store: it holds the trigger spy");
  }
}

}  // namespace
}  // namespace afterglow::replay::store_care_test

// The parts of a SQLite store, each alone.
#include <gtest/gtest.h>

#include "replay/store/sqlite/sqlite_imports.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::sqlite_parts_test {
namespace {

using namespace afterglow::test;

/// The message log of a store in memory, with one recording and one channel.
class SqliteParts : public testing::Test {
 protected:
  std::unique_ptr<SqliteConnection> connection_ = openSqliteStore(":memory:", OpenMode::ReadWrite);
  SqliteRecordings recordings_{*connection_};
  SqliteMessages messages_{*connection_, recordings_, 100};
  std::int64_t recording_ = recordings_.add({0, "", "/recorder", "fetch7"});
  std::int64_t channel_ = recordings_.addChannel(recording_, stringChannel("/said"));

  std::int64_t number(const std::string& sql) { return connection_->integer(sql); }
};

TEST_F(SqliteParts, errorIsOneLineHoweverLongTheStatements) {
  try {
    connection_->execute("\nCREATE TABLE definitions (\n  id INTEGER);\nSELECT 1;");
    FAIL() << "it is there";
  } catch (const StoreError& error) {
    EXPECT_STREQ(error.what(),
                 "sqlite::memory:: cannot run \"CREATE TABLE definitions (\": "
                 "table definitions already exists");
  }
}

TEST_F(SqliteParts, recordingIsKnownByItsKeyAndItsChannels) {
  const Recording known = recordings_.all().at(0);
  EXPECT_EQ(recordings_.add(known), recording_);
  EXPECT_EQ(recordings_.ofChannel(channel_), recording_);
  EXPECT_THROW(recordings_.ofChannel(channel_ + 1), StoreError);
  EXPECT_THROW(recordings_.require(recording_ + 1), StoreError);
}

TEST_F(SqliteParts, recordingGoesWithItsChannelsAndDefinitions) {
  recordings_.remove(recording_);
  EXPECT_EQ(number("SELECT count(*) FROM recordings"), 0);
  EXPECT_EQ(number("SELECT count(*) FROM channels"), 0);
  EXPECT_EQ(number("SELECT count(*) FROM definitions"), 0);
  EXPECT_THROW(recordings_.ofChannel(channel_), StoreError);
}

TEST_F(SqliteParts, messagesOfABatchAreStoredTogetherOrNotAtAll) {
  messages_.append({stringMessage(channel_, 1, 0, "a")}, Duplicates::Refuse);
  EXPECT_THROW(messages_.append({stringMessage(channel_, 2, 1, "b"),
                                 stringMessage(channel_, 3, 2, std::string(100, 'c'))},
                                Duplicates::Refuse),
               MessageRefused);
  EXPECT_EQ(number("SELECT count(*) FROM messages"), 1);
}

TEST_F(SqliteParts, messagesOfAnIntervalAreRemoved) {
  for (std::int64_t at_ns = 0; at_ns < 600; ++at_ns) {
    messages_.append({stringMessage(channel_, at_ns, static_cast<std::uint64_t>(at_ns), "a")},
                     Duplicates::Refuse);
  }
  messages_.remove(recording_, {100, 520});
  EXPECT_EQ(number("SELECT count(*) FROM messages"), 180);
}

TEST(StoreLocks, tellARunningImportFromADeadOne) {
  const TempFolder folder;
  const std::string store = folder.path("store.db");
  EXPECT_FALSE(isImporting(store, 3));
  {
    const ImportLock running(store, 3);
    EXPECT_TRUE(isImporting(store, 3));
    EXPECT_FALSE(isImporting(store, 4));
    EXPECT_FALSE(ImportLock::ofDead(store, 3));
    EXPECT_TRUE(ImportLock::ofDead(store, 4));
  }
  EXPECT_FALSE(isImporting(store, 3));
  EXPECT_TRUE(ImportLock::ofDead(store, 3));
}

TEST(StoreLocks, nameTheRecorderAndLetNoSecondOneIn) {
  const TempFolder folder;
  const std::string store = folder.path("store.db");
  EXPECT_FALSE(recorderOf(store));
  const RecorderLock recorder(store);
  EXPECT_NE(recorderOf(store).value().find("process "), std::string::npos);
  EXPECT_THROW(RecorderLock{store}, StoreError);
}

}  // namespace
}  // namespace afterglow::replay::sqlite_parts_test

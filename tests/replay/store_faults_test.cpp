// What a store does when its disk fails, and how long its log of commits becomes.
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <thread>

#include "replay/store/open/open_store.hpp"
#include "replay/store/sqlite/sqlite.hpp"
#include "replay/store/sqlite/sqlite_store.hpp"
#include "tests/support/faulty_disk.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::store_faults_test {
namespace {

namespace fs = std::filesystem;
using namespace afterglow::test;
using Fault = FaultyDisk::Fault;

constexpr std::uint64_t kInBatch = 20;

/// So short that a few batches fold the log of commits into the database.
SqliteLimits shortLog() {
  SqliteLimits limits;
  limits.fold_log_pages = 8;
  limits.longest_log_pages = 32;
  return limits;
}

std::vector<Message> batchFrom(std::int64_t channel, std::uint64_t first) {
  std::vector<Message> batch;
  for (std::uint64_t i = first; i < first + kInBatch; ++i) {
    batch.push_back(stringMessage(channel, static_cast<std::int64_t>(i), i, std::string(500, 'x')));
  }
  return batch;
}

std::string appendError(Store& store, const std::vector<Message>& batch) {
  try {
    store.append(batch);
  } catch (const StoreError& error) {
    return error.what();
  }
  return "";
}

/// One after the other from 0; how many there are.
std::uint64_t countInOrder(const Store& store) {
  std::uint64_t count = 0;
  for (const Message& message : readAll(*store.messages(store.behaviors({}).at(0), {}))) {
    EXPECT_EQ(message.sequence, count++);
  }
  return count;
}

/// A store, its one channel, and a behavior for ever.
struct Recorded {
  Recorded(const std::string& path, const SqliteLimits& limits)
      : store(path, OpenMode::Record, limits) {
    const auto recording = store.addRecording({0, "", "x", ""});
    channel = store.addChannel(recording, stringChannel("/a"));
    store.addBehavior(sampleBehavior(recording, {"/a"}, 0, 1'000'000'000));
  }
  SqliteStore store;
  std::int64_t channel = 0;
};

/// Fails at the n-th operation, for n = 1, 2, ... until all batches are stored without any.
void expectOneErrorAndNothingLost(Fault fault) {
  FaultyDisk disk;
  for (std::size_t n = 1;; ++n) {
    SCOPED_TRACE("failure " + std::to_string(n));
    const TempFolder folder;
    const std::string path = folder.path("store.db");
    auto recorded = std::make_unique<Recorded>(path, shortLog());
    disk.failAt(n, fault);
    std::uint64_t stored = 0;
    std::string error;
    for (int batch = 0; batch < 8 && error.empty(); ++batch) {
      error = appendError(recorded->store, batchFrom(recorded->channel, stored));
      if (error.empty()) stored += kInBatch;
    }
    if (error.empty() && !disk.hasFailed()) return;
    if (!error.empty()) {
      EXPECT_EQ(error.rfind("sqlite:" + path + ": cannot ", 0), 0u) << error;
      if (fault != Fault::NoSpace) {
        EXPECT_NE(appendError(recorded->store, batchFrom(recorded->channel, 5000))
                      .find("nothing more is written to the store until it is opened again"),
                  std::string::npos);
      }
    }
    EXPECT_GE(countInOrder(recorded->store), stored);
    disk.recover();
    recorded.reset();
    const auto reader = openStore(path, OpenMode::ReadOnly);
    const std::uint64_t kept = countInOrder(*reader);
    EXPECT_TRUE(kept == stored || kept == stored + kInBatch) << kept << " of " << stored;
    EXPECT_EQ(reader->topics(reader->behaviors({}).at(0)).empty(), kept == 0);
    ASSERT_LT(n, 1000u);
  }
}

TEST(StoreFaults, saysOnceThatTheDiskIsFullAndLosesNothingStored) {
  expectOneErrorAndNothingLost(Fault::NoSpace);
}

TEST(StoreFaults, writesNoMoreAfterAWriteErrorAndLosesNothingStored) {
  expectOneErrorAndNothingLost(Fault::WriteError);
}

TEST(StoreFaults, writesNoMoreAfterASyncErrorAndLosesNothingStored) {
  expectOneErrorAndNothingLost(Fault::SyncError);
}

TEST(StoreFaults, recordsOnceThereIsSpaceAgain) {
  FaultyDisk disk;
  const TempFolder folder;
  Recorded recorded(folder.path("store.db"), shortLog());
  disk.failAt(1, Fault::NoSpace);
  EXPECT_NE(appendError(recorded.store, batchFrom(recorded.channel, 0)), "");
  disk.recover();
  EXPECT_EQ(appendError(recorded.store, batchFrom(recorded.channel, 0)), "");
  EXPECT_EQ(countInOrder(recorded.store), kInBatch);
}

TEST(StoreFaults, endsOnASmallDiskAndIsReadableOnOneThatIsReadOnly) {
  const TempFolder folder;
  const std::string disk = folder.path("");
  if (mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=2m") != 0) {
    GTEST_SKIP() << "may not mount a small disk: " << std::strerror(errno);
  }
  const std::string path = folder.path("store.db");
  std::uint64_t stored = 0;
  {
    Recorded recorded(path, {});
    std::string error;
    while (error.empty()) {
      error = appendError(recorded.store, batchFrom(recorded.channel, stored));
      if (error.empty()) stored += kInBatch;
    }
    EXPECT_NE(error.find(": cannot "), std::string::npos) << error;
    EXPECT_NE(error.find("full"), std::string::npos) << error;
    EXPECT_EQ(countInOrder(recorded.store), stored);
  }
  EXPECT_GT(stored, kInBatch);
  const bool is_read_only = mount("", disk.c_str(), "", MS_REMOUNT | MS_RDONLY, "") == 0;
  if (is_read_only) {
    EXPECT_EQ(countInOrder(*openStore(path, OpenMode::ReadOnly)), stored);
    EXPECT_THROW(openStore(path, OpenMode::Record), StoreError);
  }
  umount2(disk.c_str(), MNT_DETACH);
  if (!is_read_only) GTEST_SKIP() << "may not make a disk read-only";
}

TEST(StoreFaults, keepsTheLogOfCommitsShortWhileOthersRead) {
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  Recorded recorded(path, shortLog());
  std::uint64_t stored = 0;
  std::uintmax_t longest = 0;
  const auto reader = openStore(path, OpenMode::ReadOnly);
  const auto cursor = reader->messages(sampleBehavior(1, {"/a"}, 0, 1'000'000'000), {});
  for (int batch = 0; batch < 100; ++batch, stored += kInBatch) {
    recorded.store.append(batchFrom(recorded.channel, stored));
    EXPECT_TRUE(cursor->next());
    longest = std::max(longest, fs::file_size(path + "-wal"));
  }
  EXPECT_LT(longest, 64u * 16384u) << "100 batches are more than 100 pages";
}

/// There is always somebody who reads, and nobody for long.
TEST(StoreFaults, keepsTheLogOfCommitsShortBehindReadersWhoTakeTurns) {
  FaultyDisk disk;
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  Recorded recorded(path, shortLog());
  std::atomic<bool> is_done{false};
  std::thread readers([&] {
    SqliteConnection one(path, SqliteAccess::ReadOnly), other(path, SqliteAccess::ReadOnly);
    const std::string begin = "BEGIN; SELECT count(*) FROM behaviors;";
    other.execute(begin);
    while (!is_done) {
      one.execute(begin);
      other.execute("COMMIT");
      other.execute(begin);
      one.execute("COMMIT");
    }
  });
  std::uintmax_t longest = 0;
  for (std::uint64_t stored = 0; stored < 300 * kInBatch; stored += kInBatch) {
    recorded.store.append(batchFrom(recorded.channel, stored));
    longest = std::max(longest, fs::file_size(path + "-wal"));
  }
  is_done = true;
  readers.join();
  EXPECT_LT(longest, 100u * 16384u) << "300 batches are more than 600 pages";
}

TEST(StoreFaults, beginsTheLogAnewOnceALongReaderHasGone) {
  FaultyDisk disk;
  const TempFolder folder;
  const std::string path = folder.path("store.db");
  Recorded recorded(path, shortLog());
  SqliteConnection foreign(path, SqliteAccess::ReadOnly);
  foreign.execute("BEGIN; SELECT count(*) FROM messages;");
  std::uint64_t stored = 0;
  const auto append = [&](int batches) {
    for (int i = 0; i < batches; ++i, stored += kInBatch) {
      recorded.store.append(batchFrom(recorded.channel, stored));
    }
  };
  append(40);
  const auto grown = fs::file_size(path + "-wal");
  EXPECT_GT(grown, 64u * 16384u) << "nothing that somebody reads may go";
  foreign.execute("COMMIT");
  append(40);
  EXPECT_LT(fs::file_size(path + "-wal"), grown + grown / 4) << "used from its beginning again";
}

}  // namespace
}  // namespace afterglow::replay::store_faults_test

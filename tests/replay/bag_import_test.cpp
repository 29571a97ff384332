// Imports beside others who write: in slices, found only when whole, taken back when they die.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

#include "replay/bags/bag_file.hpp"
#include "replay/record/recorder.hpp"
#include "replay/store/behavior_edit.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/sqlite/store_care.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::bag_import_test {
namespace {

using namespace afterglow::test;

/// More than an append takes.
constexpr std::uint64_t kMessages = 12'000;

class BagImportTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto store = openMemoryStore();
    const auto recording = store->addRecording({0, "", "/recorder", ""});
    const auto channel = store->addChannel(recording, stringChannel("/a"));
    std::vector<Message> messages;
    for (std::uint64_t i = 0; i < kMessages; ++i) {
      const auto stamp_ns = static_cast<std::int64_t>(1'000'000'000 + i);
      messages.push_back(stringMessage(channel, stamp_ns, i, "x"));
    }
    store->append(messages);
    exportBags(*store, {sampleBehavior(recording, {"/a"}, 0, 2'000'000'000)}, {}, bag_);
  }

  /// Another program imports the bag, and is killed behind its first slice.
  void importAndDie() const {
    const pid_t process = fork();
    if (process == 0) {
      const auto store = openStore(path_, OpenMode::ReadWrite);
      importBag(bag_, *store, {"", {}, [](auto, auto) { raise(SIGKILL); }});
      _exit(0);
    }
    int status = 0;
    waitpid(process, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
  }

  std::uint64_t messagesInAll() const { return storeStats(path_).messages; }

  TempFolder folder_;
  std::string bag_ = folder_.path("many.bag");
  std::string path_ = folder_.path("store.db");
};

TEST_F(BagImportTest, letsOthersWriteMeanwhileAndShowsWhenItIsWhole) {
  const auto store = openStore(path_, OpenMode::ReadWrite);
  const auto other = openStore(path_, OpenMode::ReadWrite);
  int slices = 0;
  const auto result = importBag(bag_, *store, {"", {}, [&](auto done, auto total) {
                                                 ++slices;
                                                 EXPECT_TRUE(other->behaviors({}).empty()) << done;
                                                 EXPECT_EQ(total, kMessages);
                                                 other->addRecording({0, "", "beside", ""});
                                               }});
  EXPECT_GE(slices, 3);
  EXPECT_EQ(result.messages, kMessages);
  EXPECT_EQ(other->topics(other->behaviors({}).at(0)).at(0).count, kMessages);
  EXPECT_EQ(other->dropUnfinished(), 0u);
}

TEST_F(BagImportTest, leavesNothingWhenItIsKilled) {
  importAndDie();
  EXPECT_GT(messagesInAll(), 0u) << "else this shows nothing";
  EXPECT_TRUE(openStore(path_, OpenMode::ReadOnly)->behaviors({}).empty());
  EXPECT_EQ(checkStore(path_).dead_imports, 1u);
  EXPECT_TRUE(checkStore(path_).problems.empty());
  const auto store = openStore(path_, OpenMode::ReadWrite);
  EXPECT_EQ(importBag(bag_, *store).messages, kMessages);
  EXPECT_EQ(messagesInAll(), kMessages);
  EXPECT_EQ(store->recordings().size(), 1u);
  EXPECT_EQ(checkStore(path_).dead_imports, 0u);
  EXPECT_TRUE(checkStore(path_).problems.empty());
}

TEST_F(BagImportTest, isClearedUpByPruningWhenItWasKilled) {
  importAndDie();
  const auto store = openStore(path_, OpenMode::ReadWrite);
  RetentionPolicy policy;
  policy.most_bytes = 1u << 30;
  EXPECT_TRUE(prune(*store, policy).empty());
  EXPECT_EQ(messagesInAll(), 0u);
  EXPECT_TRUE(store->recordings().empty());
}

TEST_F(BagImportTest, isStillKnownToBeDeadAfterARepair) {
  importAndDie();
  repairStore(path_);
  EXPECT_EQ(checkStore(path_).dead_imports, 1u);
  EXPECT_EQ(openStore(path_, OpenMode::ReadWrite)->dropUnfinished(), 1u);
  EXPECT_EQ(messagesInAll(), 0u);
}

TEST_F(BagImportTest, isNotTakenForDeadWhileItRuns) {
  const auto store = openStore(path_, OpenMode::ReadWrite);
  const auto other = openStore(path_, OpenMode::ReadWrite);
  bool is_first = true;
  const auto result = importBag(bag_, *store, {"outer", {}, [&](auto, auto) {
                                                 if (!std::exchange(is_first, false)) return;
                                                 EXPECT_EQ(checkStore(path_).dead_imports, 0u);
                                                 importBag(bag_, *other, {"inner", {}, {}});
                                               }});
  EXPECT_EQ(store->topics(result.behavior).at(0).count, kMessages);
  EXPECT_EQ(messagesInAll(), 2 * kMessages);
}

TEST_F(BagImportTest, isTakenBackWhenItFails) {
  const auto store = openStore(path_, OpenMode::ReadWrite);
  const auto fail = [](auto, auto) { throw std::runtime_error("as a full disk would"); };
  EXPECT_THROW(importBag(bag_, *store, {"", {}, fail}), std::runtime_error);
  EXPECT_EQ(messagesInAll(), 0u);
  EXPECT_TRUE(store->recordings().empty());
  EXPECT_EQ(importBag(bag_, *store).messages, kMessages) << "its numbers are given out again";
  EXPECT_TRUE(checkStore(path_).problems.empty());
}

TEST_F(BagImportTest, keepsNoRecorderWaiting) {
  const auto recorders = openStore(path_, OpenMode::Record);
  RecorderOptions options;
  options.batch_period = std::chrono::milliseconds(1);
  Recorder recorder(*recorders, options);
  const std::size_t a = recorder.channelIndex(stringChannel("/live"));
  const Behavior begun = recorder.begin(sampleBehavior(0, {"/live"}, 1, 2));
  std::atomic<bool> is_done{false};
  std::thread importer([&] {
    const auto store = openStore(path_, OpenMode::ReadWrite);
    for (int i = 0; i < 5; ++i) importBag(bag_, *store);
    is_done = true;
  });
  std::uint64_t offered = 0;
  std::chrono::steady_clock::duration longest{};
  while (!is_done) {
    const auto before = std::chrono::steady_clock::now();
    recorder.offer(a, {static_cast<std::int64_t>(2 + offered++)}, stringBytes("live"));
    while (recorder.load().queued_bytes > 0) std::this_thread::yield();
    longest = std::max(longest, std::chrono::steady_clock::now() - before);
  }
  importer.join();
  const RecordedCounts counts =
      recorder.end(begun.id, {static_cast<std::int64_t>(3 + offered)}, test::outcome("success"));
  EXPECT_EQ(counts.stored, offered);
  EXPECT_TRUE(counts.remarks.empty());
  EXPECT_LT(longest, std::chrono::seconds(9)) << "SQLite's patience is ten";
}

}  // namespace
}  // namespace afterglow::replay::bag_import_test

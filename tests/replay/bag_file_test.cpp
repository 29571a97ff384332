#include "replay/bags/bag_file.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <set>

#include "replay/record/snapshot.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::bag_file_test {
namespace {

namespace fs = std::filesystem;
using namespace afterglow::test;
using Texts = std::vector<std::string>;

/// What a BagError says; "" if there is none.
template <typename Work>
std::string bagErrorOf(const Work& work) {
  try {
    work();
  } catch (const BagError& error) {
    return error.what();
  }
  return "";
}

/// A store with one behavior that has ties, two publishers of one topic, a latched channel, an
/// empty message and a type that nobody knows.
class BagFileTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto recording = store_->addRecording({0, "", "/recorder", ""});
    const auto b = store_->addChannel(recording, stringChannel("/b", "/z", true));
    const auto a = store_->addChannel(recording, stringChannel("/a"));
    const auto a2 = store_->addChannel(recording, stringChannel("/a", ""));
    Channel strange = stringChannel("/strange");
    strange.type = "unheard_of/Type";
    strange.md5 = std::string(32, '0');
    strange.definition = "we/do not know!";
    const auto c = store_->addChannel(recording, strange);
    Message empty{c, Stamp{1'000'000'010}, 6, {}, {}};
    store_->append(
        {stringMessage(b, 1'000'000'000, 0, "latched"), stringMessage(a, 1'000'000'010, 3, "c"),
         stringMessage(b, 1'000'000'010, 1, "a"), stringMessage(a2, 1'000'000'010, 2, "b"), empty,
         stringMessage(b, 1'000'000'010, 4, "between"), stringMessage(a, 1'000'000'010, 5, "d"),
         stringMessage(a, 2'000'000'000, 7, "last")});
    behavior_ = sampleBehavior(recording, {"/a", "/b", "/strange"}, 1'000'000'000, 2'000'000'001);
    behavior_.id = store_->addBehavior(behavior_);
    exportBags(*store_, {behavior_}, {}, bag_);
  }

  TempFolder folder_;
  std::string bag_ = folder_.path("small.bag");
  std::unique_ptr<Store> store_ = openMemoryStore();
  Behavior behavior_;
};

void expectSame(const Store& a, const Behavior& of_a, const Store& b, const Behavior& of_b) {
  const auto first = readAll(*a.messages(of_a, {}));
  const auto second = readAll(*b.messages(of_b, {}));
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].received, second[i].received) << i;
    EXPECT_EQ(first[i].bytes, second[i].bytes) << i;
    EXPECT_EQ(a.channel(first[i].channel), b.channel(second[i].channel)) << i;
  }
}

/// Imports into a store that has something; whatever happens, it keeps just that. Returns the
/// error.
std::string importError(const std::string& bag) {
  const auto store = openMemoryStore();
  store->addRecording({0, "", "there before", ""});
  const std::string error = bagErrorOf([&] { importBag(bag, *store); });
  if (!error.empty()) {
    EXPECT_TRUE(store->behaviors({}).empty());
    EXPECT_EQ(store->addRecording({0, "", "next", ""}), 2) << "half an import was kept";
  }
  return error;
}

TEST_F(BagFileTest, givesBackWhatWasExported) {
  const auto other = openMemoryStore();
  const auto result = importBag(bag_, *other);
  EXPECT_EQ(result.messages, 8u);
  EXPECT_TRUE(result.remarks.empty());
  EXPECT_EQ(result.behavior.name, "small");
  EXPECT_EQ(result.behavior.outcome, "imported");
  EXPECT_EQ(result.behavior.begin, Stamp{1'000'000'000});
  EXPECT_EQ(result.behavior.end, Stamp{2'000'000'001}) << "the last message is in";
  EXPECT_EQ(result.behavior.topics, (Texts{"/a", "/b", "/strange"}));
  expectSame(*store_, behavior_, *other, result.behavior);
}

TEST_F(BagFileTest, tellsWhoSentOnEachTopic) {
  const auto store = openMemoryStore();
  const RecordedNodes nodes = recordedNodes(importBag(bag_, *store).behavior);
  ASSERT_EQ(nodes.count("/b"), 1u);
  EXPECT_EQ(nodes.at("/b").publishers, std::set<std::string>{"/z"});
  EXPECT_EQ(nodes.at("/b").type, "std_msgs/String");
  ASSERT_EQ(nodes.count("/a"), 1u);
  EXPECT_EQ(nodes.at("/a").publishers, std::set<std::string>{"/talker"});
  EXPECT_TRUE(nodes.at("/a").subscribers.empty()) << "a bag does not know";
}

TEST_F(BagFileTest, exportsNamedTopicsAndRangesOnly) {
  MessageRange range;
  range.topics = {"/a"};
  range.end = Stamp{1'500'000'000};
  EXPECT_EQ(exportBags(*store_, {behavior_}, range, bag_).messages, 3u);
  const auto other = openMemoryStore();
  EXPECT_EQ(readTexts(*other, importBag(bag_, *other).behavior), (Texts{"b", "c", "d"}));
}

TEST_F(BagFileTest, compressesAsAsked) {
  std::string plain(100'000, 'x');
  const auto channel = store_->addChannel(behavior_.recording, stringChannel("/a"));
  store_->append({stringMessage(channel, 1'500'000'000, 100, plain)});
  for (const auto compression : {BagCompression::Bz2, BagCompression::Lz4}) {
    BagExport options;
    options.compression = compression;
    EXPECT_EQ(exportBags(*store_, {behavior_}, {}, bag_, options).messages, 9u);
    EXPECT_LT(fs::file_size(bag_), 30'000u);
    const auto other = openMemoryStore();
    expectSame(*store_, behavior_, *other, importBag(bag_, *other).behavior);
  }
}

TEST_F(BagFileTest, holdsSeveralBehaviorsWithTheirCommonMessagesOnce) {
  Behavior inner = sampleBehavior(behavior_.recording, {"/a"}, 1'000'000'010, 1'000'000'011);
  const auto elsewhere = store_->addRecording({0, "", "/other", ""});
  const auto late = store_->addChannel(elsewhere, stringChannel("/late", "/y"));
  store_->append({stringMessage(late, 1'000'000'005, 0, "from elsewhere")});
  Behavior other = sampleBehavior(elsewhere, {"/late"}, 1'000'000'000, 2'000'000'000);
  EXPECT_EQ(exportBags(*store_, {inner, other, behavior_}, {}, bag_).messages, 9u);
  const auto back = openMemoryStore();
  const auto imported = importBag(bag_, *back).behavior;
  MessageRange texts;
  texts.topics = {"/a", "/b", "/late"};
  EXPECT_EQ(readTexts(*back, imported, texts),
            (Texts{"latched", "from elsewhere", "a", "b", "c", "between", "d", "last"}));
}

TEST_F(BagFileTest, exportsWhatElseWasRecordedAsContext) {
  Behavior narrow = behavior_;
  narrow.topics = {"/a"};
  MessageRange all;
  all.with_all_topics = true;
  EXPECT_EQ(exportBags(*store_, {narrow}, {}, bag_).messages, 4u);
  EXPECT_EQ(exportBags(*store_, {narrow}, all, bag_).messages, 8u);
}

TEST_F(BagFileTest, splitsAndPutsTogetherAgain) {
  const auto channel = store_->addChannel(behavior_.recording, stringChannel("/a"));
  std::vector<Message> batch;
  for (std::uint64_t i = 0; i < 30; ++i) {
    batch.push_back(stringMessage(channel, 1'500'000'000, 100 + i, std::string(100'000, 'x')));
  }
  store_->append(batch);
  BagExport options;
  options.split_bytes = 1'000'000;
  const auto result = exportBags(*store_, {behavior_}, {}, folder_.path("part.bag"), options);
  EXPECT_EQ(result.messages, 38u);
  ASSERT_GE(result.paths.size(), 2u);
  EXPECT_EQ(result.paths[1], folder_.path("part_1.bag"));
  const auto other = openMemoryStore();
  const Texts reversed(result.paths.rbegin(), result.paths.rend());
  const auto imported = importBags(reversed, *other);
  EXPECT_EQ(imported.messages, 38u);
  EXPECT_EQ(imported.behavior.name, "part_0");
  EXPECT_EQ(other->recordings().size(), 1u);
  expectSame(*store_, behavior_, *other, imported.behavior);
}

TEST_F(BagFileTest, keepsNothingOfSeveralBagsIfOneIsBad) {
  writeFile(folder_.path("bad.bag"), "no");
  const auto other = openMemoryStore();
  EXPECT_THROW(importBags({bag_, folder_.path("bad.bag")}, *other), BagError);
  EXPECT_TRUE(other->recordings().empty());
}

TEST_F(BagFileTest, namesAndTagsAsAsked) {
  const auto other = openMemoryStore();
  std::uint64_t done = 0, total = 0;
  const auto result = importBag(bag_, *other, {"pick", {"x", "y"}, [&](auto d, auto t) {
                                                 done = d;
                                                 total = t;
                                               }});
  EXPECT_EQ(other->behavior(result.behavior.id)->name, "pick");
  EXPECT_EQ(other->behavior(result.behavior.id)->tags, (Texts{"x", "y"}));
  EXPECT_EQ(done, 8u);
  EXPECT_EQ(total, 8u);
}

TEST_F(BagFileTest, refusesABagCutAnywhere) {
  const std::string cut = folder_.path("cut.bag");
  fs::copy_file(bag_, cut);
  const auto store = openMemoryStore();
  for (std::uintmax_t size = fs::file_size(bag_); size-- > 0;) {
    fs::resize_file(cut, size);
    const std::string error = bagErrorOf([&] { importBag(cut, *store); });
    ASSERT_EQ(error.substr(0, cut.size() + 2), cut + ": ") << "cut to " << size << " bytes";
    ASSERT_EQ(error.find('\n'), std::string::npos) << error;
    const bool has_first_line = size >= 13;
    ASSERT_TRUE(!has_first_line || error.find("cut short") != std::string::npos) << error;
  }
  EXPECT_TRUE(store->behaviors({}).empty());
  EXPECT_EQ(store->addRecording({0, "", "first", ""}), 1) << "half an import was kept";
  EXPECT_EQ(bagErrorOf([&] { importBag(bag_, *store); }), "");
}

TEST_F(BagFileTest, keepsNothingOfAnImportThatFailsHalfway) {
  const auto store = openMemoryStore();
  const auto fail = [](auto, auto) { throw std::runtime_error("as a full disk would"); };
  EXPECT_THROW(importBag(bag_, *store, {"", {}, fail}), std::runtime_error);
  EXPECT_EQ(store->addRecording({0, "", "first", ""}), 1) << "half an import was kept";
}

TEST_F(BagFileTest, survivesDamageAnywhereWithoutACrash) {
  const std::string whole = fileBytes(bag_);
  const std::string damaged = folder_.path("damaged.bag");
  fs::copy_file(bag_, damaged);
  std::fstream file(damaged, std::ios::binary | std::ios::in | std::ios::out);
  const auto writeByte = [&](std::size_t at, int byte) {
    file.seekp(static_cast<std::streamoff>(at)).put(static_cast<char>(byte)).flush();
  };
  const auto store = openMemoryStore();
  int round = 0;
  for (std::size_t at = 0; at < whole.size(); at += 5) {
    // The file header's padding, 4 KB of blanks, means nothing.
    if (whole.compare(at, 8, std::string(8, ' ')) == 0) continue;
    writeByte(at, whole[at] ^ std::array{0x01, 0x80, 0xff}[++round % 3]);
    bagErrorOf([&] { importBag(damaged, *store); });
    writeByte(at, whole[at]);
  }
}

TEST_F(BagFileTest, saysWhatIsNoBag) {
  EXPECT_NE(importError(folder_.path("none.bag")).find("none.bag: cannot open: No such file"),
            std::string::npos);
  EXPECT_NE(importError(folder_.path("")).find("is a folder"), std::string::npos);
  writeFile(bag_, "just text, and more than a first line of a bag");
  EXPECT_EQ(importError(bag_), bag_ + ": not a bag");
  writeFile(bag_, "");
  EXPECT_EQ(importError(bag_), bag_ + ": is empty");
  writeFile(bag_, "#ROSBAG V1.2\n and so on");
  EXPECT_EQ(importError(bag_), bag_ + ": a bag of version 1.2; version 2.0 can be read");
}

TEST_F(BagFileTest, saysThatABagWasNotClosed) {
  std::string bytes = fileBytes(bag_);
  const std::size_t at = bytes.find("index_pos=") + 10;
  bytes.replace(at, 8, std::string(8, '\0'));
  writeFile(bag_, bytes);
  const auto store = openMemoryStore();
  const auto result = importBag(bag_, *store);
  EXPECT_EQ(result.behavior.outcome, kIncomplete);
  ASSERT_EQ(result.remarks.size(), 1u);
  EXPECT_EQ(result.remarks[0].find(bag_ + ": was not closed by its recorder: it ends at byte "), 0u);
  EXPECT_EQ(store->behavior(result.behavior.id)->remarks, result.remarks);
  expectSame(*store_, behavior_, *store, result.behavior);
}

TEST_F(BagFileTest, takesTheWholeChunksOfABagThatWasNotClosed) {
  BagExport chunked;
  chunked.compression = BagCompression::Lz4;
  std::vector<Message> batch;
  const auto channel = store_->addChannel(behavior_.recording, stringChannel("/a"));
  for (std::uint64_t i = 0; i < 3000; ++i) {
    batch.push_back(stringMessage(channel, 1'500'000'000, 100 + i, std::string(1000, 'x')));
  }
  store_->append(batch);
  exportBags(*store_, {behavior_}, {}, bag_, chunked);
  std::string bytes = fileBytes(bag_);
  bytes.replace(bytes.find("index_pos=") + 10, 8, std::string(8, '\0'));
  // rosbag record writes 768 KiB of messages a chunk: the third one is cut.
  const std::size_t third = bytes.find("compression=lz4", bytes.find("compression=lz4", bytes.find(
                                "compression=lz4") + 1) + 1);
  ASSERT_NE(third, std::string::npos);
  writeFile(bag_, bytes.substr(0, third + 200));
  const auto store = openMemoryStore();
  const auto result = importBag(bag_, *store);
  EXPECT_EQ(result.behavior.outcome, kIncomplete);
  EXPECT_GT(result.messages, 1400u);
  EXPECT_LT(result.messages, 1700u);
}

// --------------------------------------------------------------------------- failing to write one

TEST_F(BagFileTest, leavesTheOldBagWhenExportFails) {
  const std::string before = fileBytes(bag_);
  const auto late = store_->addChannel(behavior_.recording, stringChannel("/late"));
  const std::int64_t beyond = std::int64_t{1} << 62;  // 4.6e9 s, of which a bag's 32 bits hold 4.3e9
  store_->append({stringMessage(late, beyond, 99, "too late")});
  Behavior all = behavior_;
  all.end = Stamp{beyond + 1};
  MessageRange range;
  range.topics = {"/late", "/a"};
  EXPECT_EQ(bagErrorOf([&] { exportBags(*store_, {all}, range, bag_); }),
            bag_ + ": a bag cannot hold the stamp " + std::to_string(beyond) + " ns");
  EXPECT_EQ(fileBytes(bag_), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path("")), {}), 1) << "something is left";
}

TEST_F(BagFileTest, holdsAMessageOfStampZeroAtTheFirstStampThatBagsHave) {
  const auto zero = store_->addChannel(behavior_.recording, stringChannel("/zero"));
  store_->append({stringMessage(zero, 0, 99, "zero")});
  Behavior all = behavior_;
  all.begin = {0};
  MessageRange range;
  range.topics = {"/zero"};
  EXPECT_EQ(exportBags(*store_, {all}, range, bag_).unstamped, 1u);
  const auto store = openMemoryStore();
  const auto result = importBag(bag_, *store);
  const auto messages = readAll(*store->messages(result.behavior, {}));
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_EQ(textOf(messages[0]), "zero");
  EXPECT_EQ(messages[0].received, Stamp{1}) << "ros::TIME_MIN";
}

TEST_F(BagFileTest, saysWhereABagCannotBeWritten) {
  const std::string path = folder_.path("none/x.bag");
  EXPECT_EQ(bagErrorOf([&] { exportBags(*store_, {behavior_}, {}, path); }),
            path + ": cannot write the bag: No such file or directory");
}

TEST_F(BagFileTest, leavesNothingOnAFullDisk) {
  std::vector<Message> batch;
  const auto channel = store_->addChannel(behavior_.recording, stringChannel("/a"));
  for (std::uint64_t i = 0; i < 2000; ++i) {
    batch.push_back(stringMessage(channel, 1'500'000'000, 100 + i, std::string(1000, 'x')));
  }
  store_->append(batch);
  const std::string path = folder_.path("large.bag");
  // Full from the first byte on, in the middle, and when the index is written.
  for (const rlim_t size : {0, 1'000'000, 2'090'000}) {
    const pid_t process = fork();
    if (process == 0) {
      signal(SIGXFSZ, SIG_IGN);
      const rlimit limit{size, size};
      setrlimit(RLIMIT_FSIZE, &limit);
      _exit(bagErrorOf([&] {
              exportBags(*store_, {behavior_}, {}, path);
            }).find(path + ": cannot write the bag: ") == 0
                ? 0
                : 1);
    }
    int status = 0;
    waitpid(process, &status, 0);
    EXPECT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
    EXPECT_EQ(WEXITSTATUS(status), 0) << size;
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path("")), {}), 1)
        << "something is left";
  }
}

}  // namespace
}  // namespace afterglow::replay::bag_file_test

// MCAP files: ours given back, those of others, and those whose lengths and checksums lie.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/mcap_writer.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::mcap_file_test {
namespace {

namespace fs = std::filesystem;
using namespace afterglow::test;
using Texts = std::vector<std::string>;

template <typename T>
std::string packed(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

std::string text(const std::string& value) {
  return packed(static_cast<std::uint32_t>(value.size())) + value;
}

std::string record(McapRecord kind, const std::string& content) {
  return std::string(1, static_cast<char>(kind)) +
         packed(static_cast<std::uint64_t>(content.size())) + content;
}

std::string schemaRecord(const std::string& name = "std_msgs/String") {
  return record(McapRecord::Schema,
                packed<std::uint16_t>(1) + text(name) + text("ros1msg") + text("string data\n"));
}

std::string channelRecord(std::uint16_t schema = 1, const std::string& encoding = "ros1") {
  return record(McapRecord::Channel, packed<std::uint16_t>(0) + packed(schema) + text("/a") +
                                         text(encoding) + text(""));
}

std::string messageRecord(const std::string& said, std::uint64_t log_time = 5,
                          std::uint16_t channel = 0) {
  return record(McapRecord::Message, packed(channel) + packed<std::uint32_t>(0) +
                                         packed(log_time) + packed(log_time) + text(said));
}

std::string chunkRecord(const std::string& records, std::uint64_t size, std::uint32_t checksum = 0,
                        const std::string& compression = "") {
  return record(McapRecord::Chunk,
                packed<std::uint64_t>(1) + packed<std::uint64_t>(1) + packed(size) +
                    packed(checksum) + text(compression) +
                    packed(static_cast<std::uint64_t>(records.size())) + records);
}

std::string footer(std::uint64_t summary = 0, std::uint32_t checksum = 0) {
  return record(McapRecord::Footer, packed(summary) + packed<std::uint64_t>(0) + packed(checksum));
}

/// A file of these records, without a summary.
std::string fileOf(const std::string& records, const std::string& end = footer()) {
  const std::string magic(kMcapMagic);
  return magic + record(McapRecord::Header, text("ros1") + text("")) + records +
         record(McapRecord::DataEnd, packed<std::uint32_t>(0)) + end + magic;
}

class McapFileTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto recording = store_->addRecording({0, "", "/recorder", ""});
    const auto b = store_->addChannel(recording, stringChannel("/b", "/z", true));
    const auto a = store_->addChannel(recording, stringChannel("/a", ""));
    Channel strange = stringChannel("/strange");
    strange.type = "unheard_of/Type";
    strange.md5 = std::string(32, '0');
    strange.definition = "we/do not know!";
    const auto c = store_->addChannel(recording, strange);
    store_->append({stringMessage(b, 0, 0, "latched"), stringMessage(a, 10, 3, "c"),
                    stringMessage(b, 10, 1, "a"), stringMessage(a, 10, 2, "b"),
                    Message{c, Stamp{10}, 6, {}, {}}, stringMessage(a, 2'000'000'000, 7, "last")});
    behavior_ = sampleBehavior(recording, {"/a", "/b", "/strange"}, 0, 2'000'000'001);
    behavior_.tags = {"shown"};
    behavior_.id = store_->addBehavior(behavior_);
    options_.format = RecordingFormat::Mcap;
    options_.compression = BagCompression::Lz4;
  }

  std::string errorOf(const std::string& bytes) {
    writeFile(path_, bytes);
    return errorOfFile();
  }

  /// What the import of path_ says, without its name; "" if it succeeds. It leaves nothing.
  std::string errorOfFile() {
    const auto store = openMemoryStore();
    try {
      importBag(path_, *store);
      return "";
    } catch (const BagError& error) {
      EXPECT_TRUE(store->recordings().empty()) << "half an import was kept";
      const std::string said = error.what();
      EXPECT_EQ(said.substr(0, path_.size() + 2), path_ + ": ");
      EXPECT_EQ(said.find('\n'), std::string::npos) << said;
      return said.substr(std::min(said.size(), path_.size() + 2));
    }
  }

  /// Imports path_, which has what the store has.
  void expectSame() {
    const auto other = openMemoryStore();
    const auto result = importBag(path_, *other);
    EXPECT_TRUE(result.remarks.empty());
    const auto first = readAll(*store_->messages(behavior_, {}));
    const auto second = readAll(*other->messages(result.behavior, {}));
    ASSERT_EQ(first.size(), second.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_EQ(first[i].received, second[i].received) << i;
      EXPECT_EQ(first[i].bytes, second[i].bytes) << i;
      EXPECT_EQ(store_->channel(first[i].channel), other->channel(second[i].channel)) << i;
    }
  }

  TempFolder folder_;
  std::string path_ = folder_.path("small.mcap");
  std::unique_ptr<Store> store_ = openMemoryStore();
  Behavior behavior_;
  BagExport options_;
};

TEST_F(McapFileTest, givesBackWhatWasExported) {
  for (const auto compression : {BagCompression::None, BagCompression::Lz4, BagCompression::Zstd}) {
    options_.compression = compression;
    try {
      exportBags(*store_, {behavior_}, {}, path_, options_);
    } catch (const BagError& error) {
      ASSERT_EQ(compression, BagCompression::Zstd) << error.what();
      continue;  // this machine has no libzstd
    }
    expectSame();
  }
}

TEST_F(McapFileTest, splitsAndPutsTogetherAgain) {
  const auto channel = store_->addChannel(behavior_.recording, stringChannel("/a"));
  std::vector<Message> batch;
  for (std::uint64_t i = 0; i < 30; ++i) {
    const auto stamp_ns = static_cast<std::int64_t>(1'500'000'000 + i);
    batch.push_back(stringMessage(channel, stamp_ns, 100 + i,
                                  std::string(100'000, static_cast<char>('a' + i))));
  }
  store_->append(batch);
  options_.compression = BagCompression::None;
  options_.split_bytes = 1'000'000;
  const auto result = exportBags(*store_, {behavior_}, {}, folder_.path("part.mcap"), options_);
  ASSERT_GE(result.paths.size(), 3u);
  const auto other = openMemoryStore();
  const Texts reversed(result.paths.rbegin(), result.paths.rend());
  const auto imported = importBags(reversed, *other);
  EXPECT_EQ(imported.messages, 36u);
  MessageRange texts;
  texts.topics = {"/a", "/b"};
  EXPECT_TRUE(readTexts(*other, imported.behavior, texts) == readTexts(*store_, behavior_, texts));
}

TEST_F(McapFileTest, leavesTheOldFileWhenExportFails) {
  exportBags(*store_, {behavior_}, {}, path_, options_);
  const std::string before = fileBytes(path_);
  const auto early = store_->addChannel(behavior_.recording, stringChannel("/early"));
  store_->append({stringMessage(early, -1, 99, "before 1970")});
  Behavior all = behavior_;
  all.begin = {-1};
  MessageRange range;
  range.topics = {"/early", "/a"};
  EXPECT_THROW(exportBags(*store_, {all}, range, path_, options_), BagError);
  EXPECT_EQ(fileBytes(path_), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path("")), {}), 1) << "something is left";
  try {
    exportBags(*store_, {behavior_}, {}, folder_.path("none/x.mcap"), options_);
    ADD_FAILURE() << "there is no such folder";
  } catch (const BagError& error) {
    EXPECT_EQ(error.what(), folder_.path("none/x.mcap") +
                                ": cannot write the MCAP file: No such file or directory");
  }
}

TEST_F(McapFileTest, takesTheWholeRecordsOfAFileCutAnywhere) {
  exportBags(*store_, {behavior_}, {}, path_, options_);
  std::size_t taken = 6;
  for (std::uintmax_t size = fs::file_size(path_); size-- > 0;) {
    fs::resize_file(path_, size);
    const auto store = openMemoryStore();
    try {
      const auto result = importBag(path_, *store);
      ASSERT_EQ(result.behavior.outcome, kIncomplete) << "cut to " << size << " bytes";
      ASSERT_EQ(result.remarks.size(), 1u);
      ASSERT_EQ(result.remarks[0].find(path_ + ": was not closed, or is cut short: it ends at byte " +
                                       std::to_string(size) + ", and its last whole record"), 0u);
      ASSERT_LE(result.messages, taken);
      taken = result.messages;
    } catch (const BagError& error) {
      ASSERT_TRUE(store->recordings().empty());
      const std::string said = error.what();
      const bool is_told = said.find("was not closed, or is cut short") != std::string::npos;
      ASSERT_TRUE(size < 8 || is_told) << said;
      taken = 0;
    }
  }
  EXPECT_EQ(taken, 0u);
}

TEST_F(McapFileTest, endsAFileThatWasNotClosedWhereItsRecordsAreNoMoreRecords) {
  const std::string begin = std::string(kMcapMagic) +
                            record(McapRecord::Header, text("ros1") + text("")) + schemaRecord() +
                            channelRecord() + messageRecord("whole");
  const std::string within = messageRecord("within");
  for (const std::string& end :
       {std::string(5000, '\0'),                                  // a disk that lost its power
        chunkRecord(within, within.size(), 7),                    // a chunk that was not all written
        messageRecord("of a channel that is lost", 6, 9)}) {
    writeFile(path_, begin + end);
    const auto store = openMemoryStore();
    const auto result = importBag(path_, *store);
    EXPECT_EQ(readTexts(*store, result.behavior), (Texts{"whole"}));
    EXPECT_EQ(result.behavior.outcome, kIncomplete);
  }
}

TEST_F(McapFileTest, noticesDamageAnywhereOfItsData) {
  options_.compression = BagCompression::None;
  exportBags(*store_, {behavior_}, {}, path_, options_);
  const std::string whole = fileBytes(path_);
  const std::uint8_t* footer_at =
      reinterpret_cast<const std::uint8_t*>(whole.data()) + whole.size() - 8 - 20;
  const auto summary = loadNumber<std::uint64_t>(footer_at);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    // Kind and length of the record with the data's checksum: without it the chunks' are left.
    if (at >= summary - 13 && at < summary - 4) continue;
    // Without its last bytes a file counts as not closed.
    if (at >= whole.size() - kMcapMagic.size()) continue;
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ std::array{0x01, 0x80, 0xff}[at % 3]);
    // Every byte stands below some checksum.
    EXPECT_NE(errorOf(damaged), "") << "byte " << at;
  }
}

TEST_F(McapFileTest, readsMessagesWithinAndOutsideOfChunks) {
  const std::string inside = messageRecord("within", 3);
  writeFile(path_, fileOf(schemaRecord() + channelRecord() + messageRecord("last", 9) +
                          chunkRecord(inside, inside.size()) + messageRecord("between", 5) +
                          record(static_cast<McapRecord>(0x90), "of a later version")));
  const auto store = openMemoryStore();
  const auto result = importBag(path_, *store);
  EXPECT_EQ(readTexts(*store, result.behavior), (Texts{"within", "between", "last"}));
  EXPECT_EQ(result.behavior.begin, Stamp{3});
  EXPECT_EQ(result.behavior.end, Stamp{10});
  const auto message = readAll(*store->messages(result.behavior, {})).front();
  EXPECT_EQ(store->channel(message.channel).md5, "992ce8a1687cec8c8bd883ec73ca41d1")
      << "the file did not say it";
}

TEST_F(McapFileTest, leavesOutAndNamesWhatItCannotRead) {
  const std::string other =
      record(McapRecord::Channel, packed<std::uint16_t>(1) + packed<std::uint16_t>(1) +
                                      text("/json") + text("json") + text(""));
  writeFile(path_, fileOf(schemaRecord() + channelRecord() + other + messageRecord("read") +
                          messageRecord("{}", 6, 1) + messageRecord("{}", 7, 1)));
  const auto store = openMemoryStore();
  const auto result = importBag(path_, *store);
  EXPECT_EQ(readTexts(*store, result.behavior), (Texts{"read"}));
  EXPECT_EQ(result.remarks,
            (Texts{path_ + ": left out 2 messages of /json (std_msgs/String) as it is in " +
                   "\"json\"; messages in ros1 and cdr are read, with definitions"}));
  EXPECT_EQ(errorOf(fileOf(schemaRecord() + channelRecord(1, "protobuf") + messageRecord("x"))),
            "the bag holds no messages that can be read; " + path_ +
                ": left out 1 messages of /a (std_msgs/String) as it is in \"protobuf\"; messages "
                "in ros1 and cdr are read, with definitions");
}

TEST_F(McapFileTest, saysWhatIsFalseAndWhere) {
  const std::string known = schemaRecord() + channelRecord(), message = messageRecord("x");
  const std::size_t at = fileOf("").find(record(McapRecord::DataEnd, packed<std::uint32_t>(0)));
  const std::string here = "at byte " + std::to_string(at);
  const std::string behind = "at byte " + std::to_string(at + known.size());
  EXPECT_EQ(errorOf(fileOf("")), "the bag holds no messages");
  EXPECT_EQ(errorOf(fileOf(message)),
            "the record " + here + " holds a message of channel 0, which is not there");
  EXPECT_EQ(errorOf(fileOf(channelRecord() + message)),
            "the record " + here + " names schema 1, which is not there");
  EXPECT_EQ(errorOf(fileOf(known + schemaRecord("std_msgs/Other") + message)),
            "the record " + behind + " gives schema 1 another meaning");
  EXPECT_EQ(errorOf(fileOf(known + chunkRecord(message, message.size() + 1))),
            "the chunk " + behind + " has a damaged size");
  EXPECT_EQ(errorOf(fileOf(known + chunkRecord(message, message.size(), 1))),
            "the chunk " + behind + " is damaged: it has another checksum");
  EXPECT_EQ(errorOf(fileOf(known + chunkRecord(message, std::uint64_t{1} << 40, 0, "lz4"))),
            "the chunk " + behind + " says to hold more than a GiB");
  EXPECT_EQ(errorOf(fileOf(known + chunkRecord(message, message.size(), 0, "xz"))),
            "the chunk " + behind +
                " is compressed in an unknown way; none, lz4 and zstd can be read");
  const std::string chunk = chunkRecord(message, message.size());
  EXPECT_EQ(errorOf(fileOf(known + chunkRecord(chunk, chunk.size()))),
            "the chunk " + behind + ", before its byte " + std::to_string(chunk.size()) +
                ", holds another chunk");
  const std::string endless = fileOf(known + message.substr(0, 1) + packed(~std::uint64_t{0}));
  EXPECT_EQ(errorOf(endless), "is cut short, or damaged: the record " + behind +
                                  " says to hold 18446744073709551615 bytes, the file has " +
                                  std::to_string(endless.size()));
  EXPECT_EQ(errorOf(fileOf(known + messageRecord("x", std::uint64_t{1} << 63))),
            "a message of /a has the stamp 9223372036854775808 ns, which is none of this world");
  const std::string whole = fileOf(known + message, footer(1 << 20));
  EXPECT_EQ(errorOf(whole), "the footer at byte " + std::to_string(whole.size() - 37) +
                                " says that the summary begins at byte 1048576, which it cannot");
  EXPECT_NE(errorOf(fileOf(known + message, footer(0, 7))).find("it has another checksum"),
            std::string::npos);
  EXPECT_EQ(errorOf(std::string(kMcapMagic)),
            "was not closed, or is cut short: it ends at byte 8, and its last whole record at byte "
            "8");
  EXPECT_EQ(errorOf("\x89MCAP9\r\n and more of it than that, by some bytes at least, and more"),
            "no MCAP file of version 0");
}

TEST_F(McapFileTest, takesNoMoreMemoryThanAChunkPaysFor) {
  // A hundred chunks that unpack to 10 MB each of nothing that is read.
  const std::string known = schemaRecord() + channelRecord();
  Bytes zeros;
  for (const char c : record(static_cast<McapRecord>(0x90), std::string(10 << 20, '\0'))) {
    zeros.push_back(static_cast<std::uint8_t>(c));
  }
  const Bytes frame = pack(Packing::Lz4, zeros);
  const std::string chunk =
      chunkRecord(std::string(frame.begin(), frame.end()), zeros.size(), 0, "lz4");
  std::string records = known + messageRecord("first");
  for (int i = 0; i < 100; ++i) records += chunk;
  EXPECT_EQ(errorOf(fileOf(records)), "");
  EXPECT_LT(fs::file_size(path_), std::uintmax_t{10} << 20);
}

}  // namespace
}  // namespace afterglow::replay::mcap_file_test

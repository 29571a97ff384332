// Bags whose lengths, sizes and positions lie, in every kind of chunk.
#include <gtest/gtest.h>
#include <lz4frame.h>

#include <array>
#include <cstring>

#include "replay/bags/bag_file.hpp"
#include "replay/store/open/open_store.hpp"
#include "tests/support/message_definitions.hpp"
#include "tests/support/store_samples.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::replay::hostile_bag_test {
namespace {

using namespace afterglow::test;

template <typename T>
std::string packed(T value) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  return bytes;
}

std::string field(const std::string& name, const std::string& value) {
  const std::string text = name + "=" + value;
  return packed(static_cast<std::uint32_t>(text.size())) + text;
}

std::string record(const std::string& fields, const std::string& data) {
  return packed(static_cast<std::uint32_t>(fields.size())) + fields +
         packed(static_cast<std::uint32_t>(data.size())) + data;
}

std::string op(char kind) { return field("op", std::string(1, kind)); }

std::string messageRecord(std::uint32_t connection, const std::string& data,
                          std::uint64_t time = 1) {
  return record(op(2) + field("conn", packed(connection)) + field("time", packed(time)), data);
}

std::string lz4(const std::string& bytes) {
  std::string frame(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
  frame.resize(LZ4F_compressFrame(frame.data(), frame.size(), bytes.data(), bytes.size(), nullptr));
  return frame;
}

/// A bag of one chunk and one connection, and what can be false in it.
struct MadeBag {
  std::string definition = "string data\n";
  std::string chunk;  ///< unpacked
  std::string compression = "none";
  std::uint32_t size = 0;  ///< that the chunk says
  std::vector<std::uint32_t> offsets = {0};

  explicit MadeBag(const std::string& contents)
      : chunk(contents), size(static_cast<std::uint32_t>(contents.size())) {}

  std::string bytes() const {
    std::string index;
    for (const std::uint32_t offset : offsets) index += packed(1u) + packed(0u) + packed(offset);
    const auto count = packed(static_cast<std::uint32_t>(offsets.size()));
    const std::string connection = record(
        op(7) + field("conn", packed(0u)) + field("topic", "/a"),
        field("topic", "/a") + field("type", "a/B") + field("md5sum", std::string(32, '0')) +
            field("message_definition", definition));
    const std::string body =
        record(op(5) + field("compression", compression) + field("size", packed(size)),
               compression == "lz4" ? lz4(chunk) : chunk) +
        record(op(4) + field("ver", packed(1u)) + field("conn", packed(0u)) + field("count", count),
               index);
    const auto fileHeader = [](std::uint64_t index_position) {
      return "#ROSBAG V2.0\n" + record(op(3) + field("index_pos", packed(index_position)) +
                                           field("conn_count", packed(1u)) +
                                           field("chunk_count", packed(1u)),
                                       "");
    };
    const std::size_t begin = fileHeader(0).size();
    return fileHeader(begin + body.size()) + body + connection +
           record(op(6) + field("ver", packed(1u)) +
                      field("chunk_pos", packed(static_cast<std::uint64_t>(begin))) +
                      field("start_time", packed(1ull)) + field("end_time", packed(1ull)) +
                      field("count", packed(1u)),
                  packed(0u) + count);
  }
};

class HostileBag : public testing::Test {
 protected:
  std::string importError(const std::string& bytes) {
    writeFile(bag_, bytes);
    const auto store = openMemoryStore();
    try {
      importBag(bag_, *store);
    } catch (const BagError& error) {
      EXPECT_TRUE(store->recordings().empty()) << "half an import was kept";
      return std::string(error.what()).substr(bag_.size() + 2);
    }
    return "";
  }

  TempFolder folder_;
  std::string bag_ = folder_.path("made.bag");
};

const std::string kHello = packed(5u) + "hello";

TEST_F(HostileBag, isReadWhereItTellsTheTruth) {
  for (const std::string compression : {"none", "lz4"}) {
    MadeBag made(messageRecord(0, kHello));
    made.compression = compression;
    EXPECT_EQ(importError(made.bytes()), "") << compression;
  }
}

TEST_F(HostileBag, isRefusedForARecordThatReachesBeyondItsChunk) {
  for (const std::string compression : {"none", "lz4"}) {
    MadeBag made(messageRecord(0, kHello));
    made.compression = compression;
    made.chunk.replace(made.chunk.size() - kHello.size() - 4, 4, packed(0x00FFFFFFu));
    EXPECT_EQ(importError(made.bytes()),
              "the chunk at byte 90 holds a record at its byte 46 that reaches beyond the chunk");
    made.chunk.replace(0, 4, packed(0xFFFFFFF0u));
    EXPECT_EQ(importError(made.bytes()),
              "the chunk at byte 90 holds a record header at its byte 4 that reaches beyond the "
              "chunk");
  }
}

TEST_F(HostileBag, isRefusedForAChunkOfAnotherSize) {
  MadeBag made(messageRecord(0, kHello));
  made.compression = "lz4";
  made.size = 1000;
  EXPECT_EQ(importError(made.bytes()),
            "the chunk at byte 90 holds 55 bytes, not the 1000 that it says");
  made.size = 20;
  EXPECT_EQ(importError(made.bytes()),
            "the chunk at byte 90 holds more than the 20 bytes that it says");
  made.size = 0xFFFFFFFF;
  EXPECT_EQ(importError(made.bytes()), "the chunk at byte 90 has a damaged size");
  made.compression = "zip";
  EXPECT_EQ(importError(made.bytes()),
            "the chunk at byte 90 is compressed in an unknown way; none, bz2 and lz4 can be read");
  made.compression = "bz2";
  made.size = 55;
  EXPECT_EQ(importError(made.bytes()), "the chunk at byte 90 is damaged: bzip2 says -5");
}

TEST_F(HostileBag, isRefusedForAnIndexOfOtherTimes) {
  const MadeBag made(messageRecord(0, kHello, 2));
  EXPECT_EQ(importError(made.bytes()),
            "the index has another time for the message at byte 0 of the chunk at byte 90 than the "
            "message itself; 'rosbag reindex' makes a new index");
}

TEST_F(HostileBag, isRefusedForAnIndexThatPointsElsewhere) {
  MadeBag made(messageRecord(0, kHello) + messageRecord(1, kHello));
  for (const std::uint32_t offset : {1u, 54u, 1000u, 0xFFFFFFFFu}) {
    made.offsets = {offset};
    EXPECT_EQ(importError(made.bytes()), "the index names a message at byte " +
                                             std::to_string(offset) +
                                             " of the chunk at byte 90, where none is");
  }
  made.offsets = {55};
  EXPECT_EQ(importError(made.bytes()),
            "the index names a message at byte 55 of the chunk at byte 90, where another "
            "connection's is");
  made.offsets = {0, 0};
  EXPECT_EQ(importError(made.bytes()),
            "the index names the message at byte 0 of the chunk at byte 90 twice");
}

/// It took for good, with the store locked.
TEST_F(HostileBag, isImportedAsItIsWhenItsMessagesAreOfNothing) {
  MadeBag made(messageRecord(0, ""));
  made.definition = "L1[64] x\n";
  for (int i = 1; i < 8; ++i) {
    made.definition = withTypes(made.definition, "a/L" + std::to_string(i),
                                "L" + std::to_string(i + 1) + "[64] x\n");
  }
  made.definition = withTypes(made.definition, "a/L8", "");
  EXPECT_EQ(importError(made.bytes()), "");
}

/// Whatever byte is another, and wherever the file ends.
TEST_F(HostileBag, neverGivesMoreThanAProblemOrAnImport) {
  const auto source = openMemoryStore();
  const auto recording = source->addRecording({0, "", "/recorder", ""});
  const auto channel = source->addChannel(recording, stringChannel("/a"));
  std::vector<Message> messages;
  for (std::uint64_t i = 0; i < 5; ++i) {
    messages.push_back(stringMessage(channel, 1'000'000'000 + static_cast<std::int64_t>(i), i,
                                     "message " + std::to_string(i)));
  }
  source->append(messages);
  const Behavior all = sampleBehavior(recording, {"/a"}, 0, 2'000'000'000);
  const auto store = openMemoryStore();
  for (const auto compression : {BagCompression::None, BagCompression::Bz2, BagCompression::Lz4}) {
    BagExport options;
    options.compression = compression;
    exportBags(*source, {all}, {}, bag_, options);
    const std::string whole = fileBytes(bag_);
    const auto tryImport = [&](const std::string& bytes) {
      writeFile(bag_, bytes);
      try {
        const auto imported = importBag(bag_, *store);
        EXPECT_LE(imported.messages, messages.size());
        store->removeBehavior(imported.behavior.id);
      } catch (const BagError& error) {
        const std::string text = error.what();
        EXPECT_EQ(text.substr(0, bag_.size() + 2), bag_ + ": ");
        EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      }
    };
    for (std::size_t at = 0; at < whole.size(); ++at) {
      // The file header's padding, 4 KB of blanks, means nothing.
      if (whole.compare(at, 8, std::string(8, ' ')) == 0) continue;
      std::string damaged = whole;
      damaged[at] = static_cast<char>(whole[at] ^ std::array{0x01, 0x80, 0xff}[at % 3]);
      tryImport(damaged);
      tryImport(whole.substr(0, at));
    }
  }
}

}  // namespace
}  // namespace afterglow::replay::hostile_bag_test

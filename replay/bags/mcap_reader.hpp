/// \file
/// Reads MCAP files that may come from anybody. Internal to replay.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "replay/bags/mcap_records.hpp"
#include "replay/bags/recorded_file.hpp"
#include "replay/bags/topic_intake.hpp"

namespace afterglow::replay {

/// The schemas and channels of a file, by their numbers there.
class McapDefinitions {
 public:
  /// Adds what a record says. Throws BagDamage for one that contradicts another, and for too many.
  void addSchema(McapFields fields);
  void addChannel(McapFields fields);

  bool has(std::uint16_t channel) const { return channels_.count(channel) != 0; }
  const McapChannel& channel(std::uint16_t id) const { return channels_.at(id); }
  /// Null if it has none.
  const McapSchema* schema(const McapChannel& channel) const;

 private:
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  std::uint64_t bytes_ = 0;
};

/// The messages of a file in the order they lie in, with memory for one chunk. Its indexes are not
/// believed, nor needed; checksums are checked where the file has them. Throws BagError naming
/// the file and the byte.
class McapReader : private FileBytes {
 public:
  struct Message {
    std::uint16_t channel = 0;
    std::uint64_t log_time = 0;
    const std::uint8_t* data = nullptr;  ///< until the next call
    std::size_t size = 0;
  };

  /// A file that was cut short or never closed ends behind its last whole record.
  explicit McapReader(const std::string& path);

  using FileBytes::fail;
  using FileBytes::path;
  const std::string& profile() const { return profile_; }
  std::uint64_t total() const { return total_; }  ///< the file's own count; 0: unknown
  std::uint64_t begin() const { return begin_; }  ///< log time, as the file says
  /// Empty at the end of the data.
  std::optional<Message> next();
  /// Returns the definitions that were read so far; those of a message are among them.
  const McapDefinitions& definitions() const { return definitions_; }
  /// The reason why a file that was not closed ends here; empty: it was closed.
  const std::string& whyIncomplete() const { return why_incomplete_; }

 private:
  struct Record {
    std::uint64_t at = 0;
    McapRecord kind{};
    std::uint64_t size = 0;
    std::uint64_t end() const { return at + kMcapRecordHeader + size; }
  };

  bool hasMagic(std::uint64_t at);
  void readEnds();
  void readFooter(std::uint64_t footer_at);
  void findEnd();
  void readSummary(std::uint64_t begin, std::uint64_t end);
  void findBegin();
  bool expectDataChecksum(std::uint64_t data_end);
  std::uint32_t checksum(std::uint64_t at, std::uint64_t size);
  Record record(std::uint64_t at);
  Bytes content(const Record& record);
  void pass(const Record& record);
  std::optional<Message> nextMessage();
  bool nextRecord();
  std::optional<Message> nextInChunk();
  Message message(const std::uint8_t* content, std::size_t size) const;
  void openChunk(McapFields fields);
  void endData(McapFields fields) const;

  std::uint64_t at_ = 0;        ///< position of the next record
  std::uint64_t data_end_ = 0;  ///< begin of the summary or the footer
  std::uint64_t total_ = 0, begin_ = 0;
  std::string profile_, why_incomplete_;
  McapDefinitions definitions_;
  bool has_data_checksum_ = false;
  std::uint32_t data_checksum_ = 0;  ///< checksum of the part that was read so far
  Bytes record_;                     ///< a message outside of chunks
  Bytes chunk_;                      ///< the chunk's records, unpacked
  std::size_t chunk_at_ = 0;         ///< position of the next record in the chunk
  std::uint64_t chunk_position_ = 0;
  std::optional<Message> outside_;  ///< a message outside of chunks, to be given
};

/// Messages of ROS 1 are taken byte by byte, those of ROS 2 become those of ROS 1; others are left
/// out.
class McapFile : public RecordedFile {
 public:
  McapFile(const std::string& path, FindDefinition find)
      : reader_(path), intake_(std::move(find)) {}

  const std::string& path() const override { return reader_.path(); }
  std::uint64_t total() const override { return reader_.total(); }
  Stamp begin() const override { return {static_cast<std::int64_t>(reader_.begin())}; }
  std::optional<Item> next() override;
  const Channel& channel(std::uint32_t id) const override { return intake_.channel(id); }
  std::vector<std::string> remarks() const override { return intake_.remarks(); }
  std::string whyIncomplete() const override { return reader_.whyIncomplete(); }

 private:
  void addTopic(std::uint16_t id);

  McapReader reader_;
  TopicIntake intake_;
};

}  // namespace afterglow::replay

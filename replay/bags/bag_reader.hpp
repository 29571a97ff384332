/// \file
/// Reads bags of format 2.0 that may come from anybody: rosbag_storage trusts every length and
/// position in the file. Source of the format: wiki.ros.org/Bags/Format/2.0. Internal to replay.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "replay/bags/packing.hpp"
#include "replay/bags/recorded_file.hpp"
#include "replay/messages/definitions.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/wire.hpp"

namespace afterglow::replay {

enum class BagRecord : std::uint8_t {
  MessageData = 0x02,
  BagHeader = 0x03,
  IndexData = 0x04,
  Chunk = 0x05,
  ChunkInfo = 0x06,
  Connection = 0x07,
};

/// The fields of a record's header. Views into bytes that must outlive it.
class BagFields {
 public:
  /// Empty if the bytes are no fields.
  static std::optional<BagFields> parse(const std::uint8_t* bytes, std::size_t size);

  /// Empty if there is no such field.
  std::optional<std::string_view> find(std::string_view name) const;
  /// Empty if there is no such field of this size.
  template <typename T>
  std::optional<T> number(std::string_view name) const {
    const auto value = find(name);
    if (!value || value->size() != sizeof(T)) return std::nullopt;
    return loadNumber<T>(reinterpret_cast<const std::uint8_t*>(value->data()));
  }

 private:
  std::vector<std::pair<std::string_view, std::string_view>> fields_;
};

/// An unpacked chunk: records that follow each other to its last byte.
class BagChunk {
 public:
  struct Message {
    std::uint32_t offset = 0;  ///< offset of the record, as the index names it
    std::uint32_t connection = 0;
    /// Time of reception: seconds, and nanoseconds above them; as its own header says.
    std::optional<std::uint64_t> time;
    std::size_t begin = 0, size = 0;  ///< range of the data
    /// The time of reception by the record's own field.
    Stamp received() const {
      return Stamp::fromParts(static_cast<std::uint32_t>(*time),
                              static_cast<std::uint32_t>(*time >> 32));
    }
  };
  struct Connection {
    std::uint32_t connection = 0;
    std::string topic;
    std::size_t begin = 0, size = 0;  ///< range of the data, which are fields
  };

  /// Throws BagDamage.
  explicit BagChunk(Bytes bytes);

  /// Null if no message begins there.
  const Message* find(std::uint32_t offset) const;
  /// The data of a message or a connection.
  template <typename Part>
  Bytes data(const Part& part) const {
    const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(part.begin);
    return Bytes(begin, begin + static_cast<std::ptrdiff_t>(part.size));
  }
  const std::vector<Message>& messages() const { return messages_; }  ///< the messages, by offset
  const std::vector<Connection>& connections() const { return connections_; }
  std::size_t size() const { return bytes_.size(); }

 private:
  Bytes bytes_;
  std::vector<Message> messages_;
  std::vector<Connection> connections_;
};

/// An indexed bag: records that follow each other without a gap to the file's last byte, and
/// positions that point to records of the right kind. One that was not closed has no index: its
/// whole chunks tell what is in them. Takes memory for the index and for the chunks that it is in.
class BagReader : public RecordedFile, private FileBytes {
 public:
  /// A message as the index lists it.
  struct Entry {
    Stamp received;
    std::uint64_t chunk = 0;   ///< position of its record
    std::uint32_t offset = 0;  ///< offset in the unpacked chunk
    std::uint32_t connection = 0;
  };

  /// Reads all record headers and the index, but no message. Throws BagError for anything that is
  /// not as it should be: no bag, truncated, another version.
  /// Definitions that are defective are mended by those that `find` knows.
  explicit BagReader(const std::string& path, FindDefinition find = {});

  const std::string& path() const override { return FileBytes::path(); }
  std::uint64_t total() const override { return entries_.size(); }
  Stamp begin() const override { return entries_.empty() ? Stamp{} : entries_.front().received; }
  std::optional<Item> next() override;
  std::vector<std::string> remarks() const override { return remarks_; }
  std::string whyIncomplete() const override { return why_incomplete_; }
  /// The entries by stamp, then position: in the order they were recorded.
  const std::vector<Entry>& entries() const { return entries_; }
  /// Returns the channel of an entry.
  const Channel& channel(std::uint32_t connection) const override {
    return connections_.at(connection);
  }
  /// Returns a message's bytes. Throws BagError if its chunk is damaged.
  Bytes message(const Entry& entry);

 private:
  struct Chunk {
    std::uint64_t data_at = 0;
    std::uint32_t data_size = 0;
    std::uint32_t size = 0;  ///< unpacked
    Packing packing = Packing::None;
  };
  struct Record {
    std::uint64_t at = 0, data_at = 0;
    std::uint32_t data_size = 0;
    Bytes header;
    BagFields fields;
  };
  struct Unpacked {
    std::uint64_t position;
    std::unique_ptr<BagChunk> chunk;
  };

  void readVersion();
  Record readRecord(std::uint64_t at);
  template <typename T>
  T number(const Record& record, const char* field) const;
  void readRecords();
  void readUnclosed(std::uint64_t begin);
  void readChunkAlone(const Record& record);
  void visit(const Record& record);
  void visitBagHeader(const Record& record);
  void visitChunk(const Record& record);
  void visitIndex(const Record& record);
  void visitConnection(const Record& record);
  void addConnection(std::uint32_t id, std::string_view topic, const BagFields& fields);
  void visitChunkInfo(const Record& record);
  void checkPositions() const;
  void sortEntries();
  const BagChunk& chunk(std::uint64_t position);

  const FindDefinition find_;
  std::uint64_t index_position_ = 0;
  bool is_closed_ = true;
  std::string why_incomplete_;
  std::vector<std::string> remarks_;
  std::vector<Entry> entries_;
  std::size_t next_ = 0;                          ///< index of the next entry
  std::map<std::uint64_t, Chunk> chunks_;         ///< chunks by position of the record
  std::map<std::uint64_t, BagRecord> kinds_;      ///< records that positions may point to
  std::map<std::uint32_t, Channel> connections_;  ///< connections that have a record of their own
  std::map<std::uint64_t, std::uint64_t> chunk_infos_;  ///< record -> chunk it is about
  std::vector<Unpacked> unpacked_;                  ///< read last, the latest at the end
};

}  // namespace afterglow::replay

#include "replay/bags/bag_check.hpp"

#include <cstring>
#include <filesystem>

#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kFirstLine = "#ROSBAG V2.0\n";
constexpr std::uint32_t kLargestChunk = 1u << 30;

enum Kind : std::uint8_t {
  kMessageData = 0x02,
  kBagHeader = 0x03,
  kIndexData = 0x04,
  kChunk = 0x05,
  kChunkInfo = 0x06,
  kConnection = 0x07,
};

const std::uint8_t* unsignedBytes(const std::string& text) {
  return reinterpret_cast<const std::uint8_t*>(text.data());
}

}  // namespace

BagCheck::BagCheck(const std::string& path) : path_(path) {
  std::error_code error;
  if (std::filesystem::exists(path + "/metadata.yaml", error)) {
    fail("a bag of ROS 2, which is not read; a bag of ROS 1 is");
  }
  if (std::filesystem::is_directory(path, error)) fail("is a folder");
  file_.open(path, std::ios::binary);
  if (!file_) fail(std::string("cannot open: ") + std::strerror(errno));
  file_size_ = std::filesystem::file_size(path, error);
  if (error) fail("cannot open: " + error.message());
  readVersion();
  for (std::uint64_t at = std::strlen(kFirstLine); at < file_size_;) {
    const Record record = readRecord(at);
    visit(record);
    at = record.data_at + record.data_size;
  }
  checkPositions();
}

void BagCheck::fail(const std::string& text) const { throw BagError(path_ + ": " + text); }

std::string BagCheck::read(std::uint64_t at, std::uint64_t size, const char* what) {
  if (at > file_size_ || size > file_size_ - at) {
    fail("the bag is cut short: " + std::string(what) + " at byte " + std::to_string(at) +
         " needs " + std::to_string(size) + " bytes, the file has " + std::to_string(file_size_));
  }
  std::string bytes(size, '\0');
  file_.seekg(static_cast<std::streamoff>(at));
  file_.read(bytes.data(), static_cast<std::streamsize>(size));
  if (!file_) fail("cannot read at byte " + std::to_string(at));
  return bytes;
}

std::uint32_t BagCheck::readLength(std::uint64_t at) {
  return loadNumber<std::uint32_t>(unsignedBytes(read(at, 4, "a length")));
}

void BagCheck::readVersion() {
  const std::string magic = "#ROSBAG V";
  const std::size_t length = std::min<std::uint64_t>(std::strlen(kFirstLine), file_size_);
  const std::string line = read(0, length, "the first line");
  if (line == kFirstLine) return;
  if (line.rfind("\x89MCAP", 0) == 0) {
    fail("an MCAP file, which is not read: this system packages no MCAP; a bag of ROS 1 is");
  }
  if (line.rfind("SQLite format", 0) == 0) {
    fail("an SQLite file, as bags of ROS 2 are, which are not read; a bag of ROS 1 is");
  }
  if (line.compare(0, magic.size(), magic) != 0) fail("not a bag");
  if (length < std::strlen(kFirstLine)) fail("the bag is cut short in its first line");
  fail("a bag of version " + line.substr(magic.size(), 3) + "; version 2.0 can be read");
}

BagCheck::Record BagCheck::readRecord(std::uint64_t at) {
  Record record;
  record.at = at;
  const std::uint32_t header_size = readLength(at);
  record.fields = parseFields(read(at + 4, header_size, "a record header"), at);
  record.data_size = readLength(at + 4 + header_size);
  record.data_at = at + 4 + header_size + 4;
  if (record.data_size > file_size_ - record.data_at) {
    fail("the bag is cut short: the record at byte " + std::to_string(at) + " ends at byte " +
         std::to_string(record.data_at + record.data_size) + ", the file has " +
         std::to_string(file_size_));
  }
  return record;
}

BagCheck::Fields BagCheck::parseFields(const std::string& header, std::uint64_t at) const {
  Fields fields;
  for (std::size_t begin = 0; begin < header.size();) {
    const bool has_length = header.size() - begin >= 4;
    const std::size_t length =
        has_length ? loadNumber<std::uint32_t>(unsignedBytes(header) + begin) : 0;
    const std::size_t equals = has_length ? header.find('=', begin + 4) : std::string::npos;
    if (!has_length || length > header.size() - begin - 4 || equals == std::string::npos ||
        equals >= begin + 4 + length) {
      fail("the header at byte " + std::to_string(at) + " is damaged");
    }
    fields[header.substr(begin + 4, equals - begin - 4)] =
        header.substr(equals + 1, begin + 4 + length - equals - 1);
    begin += 4 + length;
  }
  return fields;
}

template <typename T>
T BagCheck::number(const Record& record, const char* field) const {
  const auto found = record.fields.find(field);
  if (found == record.fields.end() || found->second.size() != sizeof(T)) {
    fail("the record at byte " + std::to_string(record.at) + " has no proper field \"" + field +
         "\"");
  }
  return loadNumber<T>(unsignedBytes(found->second));
}

void BagCheck::visit(const Record& record) {
  const auto kind = number<std::uint8_t>(record, "op");
  switch (kind) {
    case kBagHeader:
      return visitBagHeader(record);
    case kChunk:
      visitChunk(record);
      break;
    case kIndexData:
      return visitIndex(record);
    case kConnection:
      parseFields(read(record.data_at, record.data_size, "a connection"), record.data_at);
      connections_[number<std::uint32_t>(record, "conn")] = true;
      break;
    case kChunkInfo:
      if (record.data_size != std::uint64_t{number<std::uint32_t>(record, "count")} * 8) {
        fail("the chunk info at byte " + std::to_string(record.at) + " is damaged");
      }
      chunk_infos_[record.at] = number<std::uint64_t>(record, "chunk_pos");
      break;
    default:
      fail("a record of unknown kind " + std::to_string(kind) + " at byte " +
           std::to_string(record.at));
  }
  kinds_[record.at] = kind;
}

void BagCheck::visitBagHeader(const Record& record) {
  index_position_ = number<std::uint64_t>(record, "index_pos");
  if (index_position_ == 0) {
    fail("the bag has no index, as its recorder did not close it; 'rosbag reindex' makes one");
  }
}

void BagCheck::visitChunk(const Record& record) {
  const auto compression = record.fields.find("compression");
  const bool is_plain = compression != record.fields.end() && compression->second == "none";
  const Chunk chunk{record.data_at, number<std::uint32_t>(record, "size"), is_plain};
  if (chunk.size > kLargestChunk || (is_plain && chunk.size != record.data_size)) {
    fail("the chunk at byte " + std::to_string(record.at) + " has a damaged size");
  }
  chunks_[record.at] = chunk;
}

void BagCheck::visitIndex(const Record& record) {
  const std::uint64_t count = number<std::uint32_t>(record, "count");
  if (record.data_size != count * 12) {
    fail("the index at byte " + std::to_string(record.at) + " is damaged");
  }
  messages_ += count;
  connections_.emplace(number<std::uint32_t>(record, "conn"), false);
}

void BagCheck::checkPositions() const {
  if (index_position_ == 0) fail("the bag is cut short before its header");
  if (index_position_ > file_size_) {
    fail("the bag is cut short: its index should be at byte " + std::to_string(index_position_) +
         ", the file has " + std::to_string(file_size_));
  }
  // What is cut between two records looks whole, but for this: these records are the last.
  if (chunk_infos_.size() != chunks_.size()) fail("the bag is cut short: its index is incomplete");
  if (index_position_ != file_size_ && kinds_.count(index_position_) == 0) {
    fail("the index that should be at byte " + std::to_string(index_position_) + " is not there");
  }
  for (const auto& [at, chunk] : chunk_infos_) {
    if (chunks_.count(chunk) == 0) {
      fail("the chunk that should be at byte " + std::to_string(chunk) + " is not there");
    }
  }
  for (const auto& [connection, is_described] : connections_) {
    if (!is_described) fail("connection " + std::to_string(connection) + " is not described");
  }
}

void BagCheck::checkMessage(std::uint64_t chunk_position, std::uint32_t offset) {
  const Chunk& chunk = chunks_.at(chunk_position);
  const auto require = [&](std::uint64_t size) {
    if (offset + size > chunk.size) {
      fail("the message at byte " + std::to_string(offset) + " of the chunk at byte " +
           std::to_string(chunk_position) + " reaches beyond the chunk");
    }
  };
  require(8);
  if (!chunk.is_plain) return;  // bz2 and lz4 bring checksums of their own
  Record record;
  record.at = chunk.data_at + offset;
  const std::uint64_t header_size = readLength(record.at);
  require(4 + header_size + 4);
  record.fields = parseFields(read(record.at + 4, header_size, "a message header"), record.at);
  if (number<std::uint8_t>(record, "op") != kMessageData) {
    fail("the index names a message at byte " + std::to_string(record.at) + ", where none is");
  }
  require(4 + header_size + 4 + readLength(record.at + 4 + header_size));
}

}  // namespace afterglow::replay

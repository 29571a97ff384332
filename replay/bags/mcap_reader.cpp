#include "replay/bags/mcap_reader.hpp"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "replay/bags/bag_file.hpp"

namespace afterglow::replay {
namespace {

constexpr std::uint64_t kLargestRecord = 1u << 30;
constexpr std::uint64_t kLargestStatistics = 16 << 20;
constexpr std::uint64_t kMostDefinitions = 256 << 20;  ///< bytes of all schemas and channels
constexpr std::uint64_t kPiece = 1 << 20;
constexpr std::uint64_t kFooterSize = 20, kDataEndSize = 4;
constexpr std::uint64_t kFooterRecord = kMcapRecordHeader + kFooterSize;
constexpr std::uint64_t kDataEndRecord = kMcapRecordHeader + kDataEndSize;

std::uint32_t addToChecksum(std::uint32_t checksum, const std::uint8_t* bytes, std::size_t size) {
  // zlib takes "no bytes" for the wish to begin anew.
  return size == 0 ? checksum : static_cast<std::uint32_t>(crc32_z(checksum, bytes, size));
}

std::string byteAt(std::uint64_t at) { return "byte " + std::to_string(at); }

Packing packingOf(const std::string& name) {
  if (name.empty()) return Packing::None;
  if (name == "lz4") return Packing::Lz4;
  if (name == "zstd") return Packing::Zstd;
  throw BagDamage("is compressed in an unknown way; none, lz4 and zstd can be read");
}

bool isMd5(const std::string& text) {
  return text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::string entry(const McapChannel& channel, const char* key) {
  const auto found = channel.metadata.find(key);
  return found == channel.metadata.end() ? "" : found->second;
}

Channel ros1Channel(const McapChannel& from, const McapSchema& schema) {
  Channel channel{from.topic,
                  schema.name,
                  entry(from, "md5sum"),
                  schema.text,
                  entry(from, "latching") == "1",
                  entry(from, "callerid")};
  if (!isMd5(channel.md5)) channel.md5.clear();
  return channel;
}

}  // namespace

void McapDefinitions::addSchema(McapFields fields) {
  bytes_ += fields.left();
  const auto id = fields.number<std::uint16_t>();
  McapSchema schema;
  schema.name = fields.string();
  schema.encoding = fields.string();
  schema.text = fields.string();
  const auto [known, is_new] = schemas_.try_emplace(id, schema);
  if (!is_new && !(known->second == schema)) {
    throw BagDamage("gives schema " + std::to_string(id) + " another meaning");
  }
  if (bytes_ > kMostDefinitions) throw BagDamage("is one definition too many");
}

void McapDefinitions::addChannel(McapFields fields) {
  bytes_ += fields.left();
  const auto id = fields.number<std::uint16_t>();
  McapChannel channel;
  channel.schema = fields.number<std::uint16_t>();
  channel.topic = fields.string();
  channel.encoding = fields.string();
  channel.metadata = fields.strings();
  if (channel.schema != 0 && schemas_.count(channel.schema) == 0) {
    throw BagDamage("names schema " + std::to_string(channel.schema) + ", which is not there");
  }
  const auto [known, is_new] = channels_.try_emplace(id, channel);
  if (!is_new && !(known->second == channel)) {
    throw BagDamage("gives channel " + std::to_string(id) + " another meaning");
  }
  if (bytes_ > kMostDefinitions) throw BagDamage("is one definition too many");
}

const McapSchema* McapDefinitions::schema(const McapChannel& channel) const {
  const auto found = schemas_.find(channel.schema);
  return found == schemas_.end() ? nullptr : &found->second;
}

McapReader::McapReader(const std::string& path) : FileBytes(path) {
  readEnds();
  at_ = kMcapMagic.size();
  const Record header = record(at_);
  if (header.kind != McapRecord::Header) fail("has no header at " + byteAt(at_));
  nextRecord();
  if (begin_ == 0) findBegin();
}

// ---------------------------------------------------------------------------------------- the ends

bool McapReader::hasMagic(std::uint64_t at) {
  const Bytes bytes = read(at, kMcapMagic.size());
  return std::equal(bytes.begin(), bytes.end(), kMcapMagic.begin(),
                    [](std::uint8_t a, char b) { return a == static_cast<std::uint8_t>(b); });
}

void McapReader::readEnds() {
  if (!hasMagic(0)) fail("no MCAP file of version 0");
  const std::uint64_t shortest = 2 * kMcapMagic.size() + kFooterRecord;
  if (fileSize() >= shortest && hasMagic(fileSize() - kMcapMagic.size())) {
    readFooter(fileSize() - kMcapMagic.size() - kFooterRecord);
  } else {
    findEnd();
  }
}

/// The records of a file without its last bytes are whole up to somewhere.
void McapReader::findEnd() {
  data_end_ = kMcapMagic.size();
  while (data_end_ + kMcapRecordHeader <= fileSize()) {
    const Bytes header = read(data_end_, kMcapRecordHeader);
    const auto size = loadNumber<std::uint64_t>(header.data() + 1);
    // A disk that lost its power leaves zeros.
    if (header[0] == 0 || size > fileSize() - data_end_ - kMcapRecordHeader) break;
    data_end_ += kMcapRecordHeader + size;
  }
  why_incomplete_ = "was not closed, or is cut short: it ends at " + byteAt(fileSize()) +
                    ", and its last whole record at " + byteAt(data_end_);
  if (data_end_ == kMcapMagic.size()) fail(why_incomplete_);
}

void McapReader::readFooter(std::uint64_t footer_at) {
  const Record footer = record(footer_at);
  if (footer.kind != McapRecord::Footer || footer.size != kFooterSize) {
    fail("has no footer at " + byteAt(footer_at));
  }
  const Bytes bytes = read(footer_at + kMcapRecordHeader, kFooterSize);
  McapFields fields(bytes.data(), bytes.size());
  const auto summary = fields.number<std::uint64_t>();
  fields.take(8);  // of the summary offsets, which nothing here needs
  const auto expected = fields.number<std::uint32_t>();
  if (summary != 0 && (summary < kMcapMagic.size() || summary > footer_at)) {
    fail("the footer at " + byteAt(footer_at) + " says that the summary begins at " +
         byteAt(summary) + ", which it cannot");
  }
  const std::uint64_t summary_at = summary == 0 ? footer_at : summary;
  const std::uint64_t checked = footer_at + kMcapRecordHeader + 16 - summary_at;
  if (expected != 0 && checksum(summary_at, checked) != expected) {
    fail("the summary at " + byteAt(summary_at) + " is damaged: it has another checksum");
  }
  data_end_ = summary_at;
  has_data_checksum_ = expectDataChecksum(summary_at);
  readSummary(summary_at, footer_at);
}

/// Returns true if the record that ends the data has a checksum of it.
bool McapReader::expectDataChecksum(std::uint64_t data_end) {
  if (data_end < kMcapMagic.size() + kDataEndRecord) return false;
  const Record end = record(data_end - kDataEndRecord);
  if (end.kind != McapRecord::DataEnd || end.size != kDataEndSize) return false;
  const Bytes bytes = read(end.at + kMcapRecordHeader, kDataEndSize);
  const Bytes magic = read(0, kMcapMagic.size());
  data_checksum_ = addToChecksum(0, magic.data(), magic.size());
  return loadNumber<std::uint32_t>(bytes.data()) != 0;
}

void McapReader::readSummary(std::uint64_t begin, std::uint64_t end) {
  for (std::uint64_t at = begin; at < end;) {
    const Record found = record(at);
    if (found.kind == McapRecord::Statistics && found.size <= kLargestStatistics) {
      const Bytes bytes = read(at + kMcapRecordHeader, found.size);
      try {
        McapFields fields(bytes.data(), bytes.size());
        total_ = fields.number<std::uint64_t>();
        fields.take(2 + 4 + 4 + 4 + 4);  // schemas, channels, attachments, metadata, chunks
        begin_ = fields.number<std::uint64_t>();
      } catch (const BagDamage& damage) {
        fail("the statistics at " + byteAt(at) + " " + damage.what());
      }
    }
    at = found.end();
  }
}

/// Finds the begin: without statistics the first message, or the first chunk, tells.
void McapReader::findBegin() {
  for (std::uint64_t at = at_; at < data_end_;) {
    const Record found = record(at);
    const bool is_message = found.kind == McapRecord::Message && found.size >= 14;
    const bool is_chunk = found.kind == McapRecord::Chunk && found.size >= 8;
    if (is_message || is_chunk) {
      begin_ = loadNumber<std::uint64_t>(read(at + kMcapRecordHeader + (is_message ? 6 : 0), 8)
                                             .data());
      return;
    }
    at = found.end();
  }
}

std::uint32_t McapReader::checksum(std::uint64_t at, std::uint64_t size) {
  std::uint32_t sum = 0;
  for (const std::uint64_t end = at + size; at < end;) {
    const Bytes piece = read(at, std::min(kPiece, end - at));
    sum = addToChecksum(sum, piece.data(), piece.size());
    at += piece.size();
  }
  return sum;
}

// ------------------------------------------------------------------------------------ the records

McapReader::Record McapReader::record(std::uint64_t at) {
  const Bytes bytes = read(at, kMcapRecordHeader);
  const Record record{at, static_cast<McapRecord>(bytes[0]),
                      loadNumber<std::uint64_t>(bytes.data() + 1)};
  if (record.size > fileSize() - at - kMcapRecordHeader) {
    fail("is cut short, or damaged: the record at " + byteAt(at) + " says to hold " +
         std::to_string(record.size) + " bytes, the file has " + std::to_string(fileSize()));
  }
  return record;
}

/// The record's content, which counts for the checksum of the data.
Bytes McapReader::content(const Record& record) {
  if (record.size > kLargestRecord) {
    fail("the record at " + byteAt(record.at) + " is larger than a GiB");
  }
  if (has_data_checksum_) {
    const Bytes header = read(record.at, kMcapRecordHeader);
    data_checksum_ = addToChecksum(data_checksum_, header.data(), header.size());
  }
  Bytes bytes = read(record.at + kMcapRecordHeader, record.size);
  if (has_data_checksum_) {
    data_checksum_ = addToChecksum(data_checksum_, bytes.data(), bytes.size());
  }
  return bytes;
}

/// Does what content() does, for a record that nobody needs.
void McapReader::pass(const Record& record) {
  if (!has_data_checksum_) return;
  for (std::uint64_t at = record.at; at < record.end();) {
    const Bytes piece = read(at, std::min(kPiece, record.end() - at));
    data_checksum_ = addToChecksum(data_checksum_, piece.data(), piece.size());
    at += piece.size();
  }
}

/// Reads the next record of the file; false at the end of the data.
bool McapReader::nextRecord() {
  if (at_ >= data_end_) return false;
  const Record next = record(at_);
  if (next.end() > data_end_) {
    fail("the record at " + byteAt(at_) + " reaches beyond the end of the data at " +
         byteAt(data_end_));
  }
  try {
    switch (next.kind) {
      case McapRecord::Header: {
        const Bytes bytes = content(next);
        profile_ = McapFields(bytes.data(), bytes.size()).string();
        break;
      }
      case McapRecord::Schema: {
        const Bytes bytes = content(next);
        definitions_.addSchema(McapFields(bytes.data(), bytes.size()));
        break;
      }
      case McapRecord::Channel: {
        const Bytes bytes = content(next);
        definitions_.addChannel(McapFields(bytes.data(), bytes.size()));
        break;
      }
      case McapRecord::Message:
        record_ = content(next);
        outside_ = message(record_.data(), record_.size());
        break;
      case McapRecord::Chunk: {
        const Bytes bytes = content(next);
        chunk_position_ = next.at;
        openChunk(McapFields(bytes.data(), bytes.size()));
        break;
      }
      case McapRecord::DataEnd: {
        const Bytes bytes = read(next.at + kMcapRecordHeader, std::min(next.size, kDataEndSize));
        endData(McapFields(bytes.data(), bytes.size()));
        at_ = data_end_;
        return false;
      }
      default:  // indexes, attachments, what later versions may add
        pass(next);
    }
  } catch (const BagDamage& damage) {
    fail(std::string(next.kind == McapRecord::Chunk ? "the chunk" : "the record") + " at " +
         byteAt(next.at) + " " + damage.what());
  }
  at_ = next.end();
  return true;
}

void McapReader::openChunk(McapFields fields) {
  fields.take(16);  // begin and end: each message says when it was
  const auto size = fields.number<std::uint64_t>();
  const auto expected = fields.number<std::uint32_t>();
  const Packing packing = packingOf(fields.string());
  const auto packed_size = fields.number<std::uint64_t>();
  if (size > kLargestRecord) throw BagDamage("says to hold more than a GiB");
  const std::uint8_t* begin = fields.take(packed_size);
  chunk_ = unpack(packing, Bytes(begin, begin + packed_size), size);
  chunk_at_ = 0;
  const bool is_sound =
      expected == 0 || addToChecksum(0, chunk_.data(), chunk_.size()) == expected;
  if (!is_sound) throw BagDamage("is damaged: it has another checksum");
}

void McapReader::endData(McapFields fields) const {
  if (!has_data_checksum_) return;
  if (fields.number<std::uint32_t>() != data_checksum_) {
    throw BagDamage("has another checksum than the data before it, which is damaged");
  }
}

// ----------------------------------------------------------------------------------- the messages

McapReader::Message McapReader::message(const std::uint8_t* content, std::size_t size) const {
  McapFields fields(content, size);
  Message message;
  message.channel = fields.number<std::uint16_t>();
  fields.take(4);  // sequence: the order in the file tells
  message.log_time = fields.number<std::uint64_t>();
  fields.take(8);  // publish time
  message.size = fields.left();
  message.data = fields.take(message.size);
  if (!definitions_.has(message.channel)) {
    throw BagDamage("holds a message of channel " + std::to_string(message.channel) +
                    ", which is not there");
  }
  return message;
}

/// Empty at the chunk's end.
std::optional<McapReader::Message> McapReader::nextInChunk() {
  try {
    while (chunk_at_ < chunk_.size()) {
      McapFields fields(chunk_.data() + chunk_at_, chunk_.size() - chunk_at_);
      const auto kind = static_cast<McapRecord>(fields.number<std::uint8_t>());
      const auto size = fields.number<std::uint64_t>();
      const std::uint8_t* content = fields.take(size);
      chunk_at_ += kMcapRecordHeader + size;
      const McapFields inside(content, size);
      if (kind == McapRecord::Schema) definitions_.addSchema(inside);
      if (kind == McapRecord::Channel) definitions_.addChannel(inside);
      if (kind == McapRecord::Chunk) throw BagDamage("holds another chunk");
      if (kind == McapRecord::Message) return message(content, size);
    }
  } catch (const BagDamage& damage) {
    fail("the chunk at " + byteAt(chunk_position_) + ", before its byte " +
         std::to_string(chunk_at_) + ", " + damage.what());
  }
  return std::nullopt;
}

std::optional<McapReader::Message> McapReader::next() {
  if (why_incomplete_.empty()) return nextMessage();
  try {
    return nextMessage();
  } catch (const BagError& damage) {
    // What was being written when its recorder died.
    why_incomplete_ += "; " + std::string(damage.what()).substr(path().size() + 2);
    at_ = data_end_;
    chunk_.clear();
    return std::nullopt;
  }
}

std::optional<McapReader::Message> McapReader::nextMessage() {
  for (;;) {
    if (const auto message = nextInChunk()) return message;
    chunk_.clear();
    chunk_at_ = 0;
    outside_.reset();
    if (!nextRecord()) return std::nullopt;
    if (outside_) return outside_;
  }
}

void McapFile::addTopic(std::uint16_t id) {
  const McapChannel& channel = reader_.definitions().channel(id);
  const McapSchema* schema = reader_.definitions().schema(channel);
  const std::string type = schema ? schema->name : "no type";
  const bool is_ros1 = channel.encoding == "ros1" && schema && schema->encoding == "ros1msg";
  if (is_ros1) {
    intake_.addRos1(id, ros1Channel(channel, *schema));
  } else if (channel.encoding == "cdr" && schema) {
    intake_.addRos2(id, {channel.topic, type, channel.encoding, schema->encoding, schema->text,
                         entry(channel, "offered_qos_profiles")});
  } else if (!schema) {
    intake_.leaveOut(id, channel.topic, type,
                     "its channel names no schema, so that its type is unknown");
  } else {
    intake_.leaveOut(id, channel.topic, type,
                     "it is in \"" + channel.encoding.substr(0, 40) +
                         "\"; messages in ros1 and cdr are read, with definitions");
  }
}

std::optional<RecordedFile::Item> McapFile::next() {
  while (const auto message = reader_.next()) {
    if (!intake_.knows(message->channel)) addTopic(message->channel);
    if (message->log_time > std::uint64_t{std::numeric_limits<std::int64_t>::max()}) {
      reader_.fail("a message of " + reader_.definitions().channel(message->channel).topic +
                   " has the stamp " + std::to_string(message->log_time) +
                   " ns, which is none of this world");
    }
    auto bytes =
        intake_.take(message->channel, Bytes(message->data, message->data + message->size));
    if (!bytes) continue;
    return Item{
        message->channel, {static_cast<std::int64_t>(message->log_time)}, *std::move(bytes)};
  }
  return std::nullopt;
}

}  // namespace afterglow::replay

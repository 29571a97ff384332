#include "replay/bags/bag_reader.hpp"

#include <algorithm>
#include <cstring>
#include <string>
#include <tuple>

#include "replay/bags/bag_file.hpp"

namespace afterglow::replay {

std::optional<BagFields> BagFields::parse(const std::uint8_t* bytes, std::size_t size) {
  BagFields parsed;
  parsed.fields_.reserve(4);
  const std::string_view all(reinterpret_cast<const char*>(bytes), size);
  for (std::size_t at = 0; at < size;) {
    if (size - at < 4) return std::nullopt;
    const std::size_t length = loadNumber<std::uint32_t>(bytes + at);
    at += 4;
    if (length > size - at) return std::nullopt;
    const std::string_view field = all.substr(at, length);
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos) return std::nullopt;
    parsed.fields_.emplace_back(field.substr(0, equals), field.substr(equals + 1));
    at += length;
  }
  return parsed;
}

std::optional<std::string_view> BagFields::find(std::string_view name) const {
  for (const auto& [known, value] : fields_) {
    if (known == name) return value;
  }
  return std::nullopt;
}

BagChunk::BagChunk(Bytes bytes) : bytes_(std::move(bytes)) {
  std::size_t at = 0;
  const auto lengthAt = [&](const char* of) -> std::size_t {
    if (bytes_.size() - at < 4) throw BagDamage("ends within a length");
    const std::size_t length = loadNumber<std::uint32_t>(bytes_.data() + at);
    at += 4;
    if (length > bytes_.size() - at) {
      throw BagDamage(std::string("holds ") + of + " at its byte " + std::to_string(at) +
                      " that reaches beyond the chunk");
    }
    return length;
  };
  while (at < bytes_.size()) {
    Message message;
    message.offset = static_cast<std::uint32_t>(at);
    const std::size_t header_size = lengthAt("a record header");
    const auto fields = BagFields::parse(bytes_.data() + at, header_size);
    at += header_size;
    message.size = lengthAt("a record");
    message.begin = at;
    at += message.size;
    const auto kind = fields ? fields->number<std::uint8_t>("op") : std::nullopt;
    const auto connection = fields ? fields->number<std::uint32_t>("conn") : std::nullopt;
    const bool is_message = kind == static_cast<std::uint8_t>(BagRecord::MessageData);
    const bool is_connection = kind == static_cast<std::uint8_t>(BagRecord::Connection);
    if (!connection || (!is_message && !is_connection)) {
      throw BagDamage("holds a damaged record at its byte " + std::to_string(message.offset));
    }
    message.connection = *connection;
    message.time = fields->number<std::uint64_t>("time");
    if (is_message) {
      messages_.push_back(message);
    } else {
      const std::string topic(fields->find("topic").value_or(""));
      connections_.push_back({message.connection, topic, message.begin, message.size});
    }
  }
}

const BagChunk::Message* BagChunk::find(std::uint32_t offset) const {
  const auto found = std::lower_bound(
      messages_.begin(), messages_.end(), offset,
      [](const Message& message, std::uint32_t wanted) { return message.offset < wanted; });
  return found != messages_.end() && found->offset == offset ? &*found : nullptr;
}

namespace {

constexpr const char* kFirstLine = "#ROSBAG V2.0\n";
constexpr std::uint32_t kLargestChunk = 1u << 30;
constexpr std::size_t kIndexEntry = 12;  ///< bytes: time, offset
/// Messages of neighboring chunks overlap in time where their stamps are not in order.
constexpr std::size_t kMostUnpacked = 4;
constexpr std::size_t kMostUnpackedBytes = 64 << 20;

}  // namespace

BagReader::BagReader(const std::string& path, FindDefinition find)
    : FileBytes(path), find_(std::move(find)) {
  readVersion();
  readRecords();
  if (is_closed_) checkPositions();
  sortEntries();
}

void BagReader::readRecords() {
  for (std::uint64_t at = std::strlen(kFirstLine); at < fileSize();) {
    const Record record = readRecord(at);
    visit(record);
    at = record.data_at + record.data_size;
    if (!is_closed_) return readUnclosed(at);
  }
}

/// The records up to the first that is not whole: what its recorder was writing when it died.
void BagReader::readUnclosed(std::uint64_t begin) {
  std::uint64_t end = begin;
  try {
    while (end < fileSize()) {
      const Record record = readRecord(end);
      const auto kind = static_cast<BagRecord>(number<std::uint8_t>(record, "op"));
      if (kind == BagRecord::Chunk) readChunkAlone(record);
      end = record.data_at + record.data_size;
    }
  } catch (const BagError&) {  // the byte tells
  }
  why_incomplete_ = "was not closed by its recorder: it ends at byte " +
                    std::to_string(fileSize()) + ", and its last whole record at byte " +
                    std::to_string(end);
}

/// A chunk holds its connections, too.
void BagReader::readChunkAlone(const Record& record) {
  visitChunk(record);
  const BagChunk& chunk = this->chunk(record.at);
  for (const BagChunk::Connection& found : chunk.connections()) {
    const Bytes data = chunk.data(found);
    const auto fields = BagFields::parse(data.data(), data.size());
    if (!fields) fail("connection " + std::to_string(found.connection) + " is damaged");
    addConnection(found.connection, found.topic, *fields);
  }
  std::vector<Entry> entries;
  for (const BagChunk::Message& message : chunk.messages()) {
    if (!message.time || connections_.count(message.connection) == 0) {
      fail("the chunk at byte " + std::to_string(record.at) + " is damaged");
    }
    entries.push_back({message.received(), record.at, message.offset, message.connection});
  }
  entries_.insert(entries_.end(), entries.begin(), entries.end());
}

// ------------------------------------------------------------------------------------ the records

void BagReader::readVersion() {
  const std::string magic = "#ROSBAG V";
  const std::size_t length = std::min<std::uint64_t>(std::strlen(kFirstLine), fileSize());
  const Bytes bytes = read(0, length, "the first line");
  const std::string line(bytes.begin(), bytes.end());
  if (line == kFirstLine) return;
  if (line.compare(0, magic.size(), magic) != 0) fail("not a bag");
  if (length < std::strlen(kFirstLine)) fail("the bag is cut short in its first line");
  fail("a bag of version " + line.substr(magic.size(), 3) + "; version 2.0 can be read");
}

BagReader::Record BagReader::readRecord(std::uint64_t at) {
  const auto lengthAt = [this](std::uint64_t place) {
    return loadNumber<std::uint32_t>(read(place, 4, "a length").data());
  };
  Record record;
  record.at = at;
  const std::uint32_t header_size = lengthAt(at);
  record.header = read(at + 4, header_size, "a record header");
  auto fields = BagFields::parse(record.header.data(), record.header.size());
  if (!fields) fail("the header at byte " + std::to_string(at) + " is damaged");
  record.fields = std::move(*fields);
  record.data_size = lengthAt(at + 4 + header_size);
  record.data_at = at + 4 + header_size + 4;
  if (record.data_size > fileSize() - record.data_at) {
    fail("the bag is cut short: the record at byte " + std::to_string(at) + " ends at byte " +
         std::to_string(record.data_at + record.data_size) + ", the file has " +
         std::to_string(fileSize()));
  }
  return record;
}

template <typename T>
T BagReader::number(const Record& record, const char* field) const {
  const auto found = record.fields.number<T>(field);
  if (!found) {
    fail("the record at byte " + std::to_string(record.at) + " has no proper field \"" + field +
         "\"");
  }
  return *found;
}

void BagReader::visit(const Record& record) {
  const auto kind = static_cast<BagRecord>(number<std::uint8_t>(record, "op"));
  switch (kind) {
    case BagRecord::BagHeader:
      return visitBagHeader(record);
    case BagRecord::Chunk:
      visitChunk(record);
      break;
    case BagRecord::IndexData:
      return visitIndex(record);
    case BagRecord::Connection:
      visitConnection(record);
      break;
    case BagRecord::ChunkInfo:
      visitChunkInfo(record);
      break;
    default:
      fail("a record of unknown kind " + std::to_string(static_cast<int>(kind)) + " at byte " +
           std::to_string(record.at));
  }
  kinds_[record.at] = kind;
}

void BagReader::visitBagHeader(const Record& record) {
  index_position_ = number<std::uint64_t>(record, "index_pos");
  is_closed_ = index_position_ != 0;
  if (!record.fields.find("encryptor").value_or("").empty()) {
    fail("the bag is encrypted, which is not read");
  }
}

void BagReader::visitChunk(const Record& record) {
  Chunk chunk{record.data_at, record.data_size, number<std::uint32_t>(record, "size"),
              Packing::None};
  const std::string_view packing = record.fields.find("compression").value_or("");
  if (packing == "bz2") {
    chunk.packing = Packing::Bz2;
  } else if (packing == "lz4") {
    chunk.packing = Packing::Lz4;
  } else if (packing != "none") {
    fail("the chunk at byte " + std::to_string(record.at) +
         " is compressed in an unknown way; none, bz2 and lz4 can be read");
  }
  const bool is_plain = chunk.packing == Packing::None;
  if (chunk.size > kLargestChunk || (is_plain && chunk.size != record.data_size)) {
    fail("the chunk at byte " + std::to_string(record.at) + " has a damaged size");
  }
  chunks_[record.at] = chunk;
}

/// The index of one connection's messages in the chunk before it.
void BagReader::visitIndex(const Record& record) {
  const std::uint64_t count = number<std::uint32_t>(record, "count");
  const bool is_known = number<std::uint32_t>(record, "ver") == 1 && !chunks_.empty();
  if (!is_known || record.data_size != count * kIndexEntry) {
    fail("the index at byte " + std::to_string(record.at) + " is damaged");
  }
  const auto connection = number<std::uint32_t>(record, "conn");
  const Bytes data = read(record.data_at, record.data_size, "an index");
  for (const std::uint8_t* at = data.data(); at != data.data() + data.size(); at += kIndexEntry) {
    const auto secs = loadNumber<std::uint32_t>(at), nsecs = loadNumber<std::uint32_t>(at + 4);
    entries_.push_back({Stamp::fromParts(secs, nsecs), chunks_.rbegin()->first,
                        loadNumber<std::uint32_t>(at + 8), connection});
  }
}

void BagReader::visitConnection(const Record& record) {
  const Bytes data = read(record.data_at, record.data_size, "a connection");
  const auto fields = BagFields::parse(data.data(), data.size());
  const auto topic = record.fields.find("topic");
  if (!topic || !fields) {
    fail("the connection at byte " + std::to_string(record.at) + " is damaged");
  }
  addConnection(number<std::uint32_t>(record, "conn"), *topic, *fields);
}

void BagReader::addConnection(std::uint32_t id, std::string_view topic, const BagFields& fields) {
  if (connections_.count(id) != 0) return;
  const auto type = fields.find("type"), md5 = fields.find("md5sum");
  const auto definition = fields.find("message_definition");
  if (!type || !md5 || !definition) {
    fail("connection " + std::to_string(id) + " is damaged: it lacks type, MD5 or definition");
  }
  Channel channel{std::string(topic),
                  std::string(*type),
                  std::string(*md5),
                  std::string(*definition),
                  fields.find("latching") == "1",
                  std::string(fields.find("callerid").value_or(""))};
  const std::string why = channel.md5.empty() ? "" : mendDefinition(channel, find_);
  if (!why.empty()) remarks_.push_back(mendedText(channel, why));
  connections_.emplace(id, std::move(channel));
}

void BagReader::visitChunkInfo(const Record& record) {
  if (record.data_size != std::uint64_t{number<std::uint32_t>(record, "count")} * 8) {
    fail("the chunk info at byte " + std::to_string(record.at) + " is damaged");
  }
  chunk_infos_[record.at] = number<std::uint64_t>(record, "chunk_pos");
}

void BagReader::checkPositions() const {
  if (index_position_ == 0) fail("the bag is cut short before its header");
  if (index_position_ > fileSize()) {
    fail("the bag is cut short: its index should be at byte " + std::to_string(index_position_) +
         ", the file has " + std::to_string(fileSize()));
  }
  // A file that was cut between two records shows it only here: these records are the last ones.
  if (chunk_infos_.size() != chunks_.size()) fail("the bag is cut short: its index is incomplete");
  if (index_position_ != fileSize() && kinds_.count(index_position_) == 0) {
    fail("the index that should be at byte " + std::to_string(index_position_) + " is not there");
  }
  for (const auto& [at, chunk] : chunk_infos_) {
    if (chunks_.count(chunk) == 0) {
      fail("the chunk that should be at byte " + std::to_string(chunk) + " is not there");
    }
  }
  for (const Entry& entry : entries_) {
    if (connections_.count(entry.connection) == 0) {
      fail("connection " + std::to_string(entry.connection) + " is not described");
    }
  }
}

/// Otherwise a message that the index names a million times would be stored as often.
void BagReader::sortEntries() {
  const auto place = [](const Entry& entry) { return std::tie(entry.chunk, entry.offset); };
  std::sort(entries_.begin(), entries_.end(),
            [&](const Entry& a, const Entry& b) { return place(a) < place(b); });
  const auto twice =
      std::adjacent_find(entries_.begin(), entries_.end(),
                         [&](const Entry& a, const Entry& b) { return place(a) == place(b); });
  if (twice != entries_.end()) {
    fail("the index names the message at byte " + std::to_string(twice->offset) +
         " of the chunk at byte " + std::to_string(twice->chunk) + " twice");
  }
  std::stable_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
    return a.received < b.received;
  });
}

// ----------------------------------------------------------------------------------- the messages

const BagChunk& BagReader::chunk(std::uint64_t position) {
  const auto known = std::find_if(unpacked_.begin(), unpacked_.end(),
                                  [&](const auto& entry) { return entry.position == position; });
  if (known != unpacked_.end()) {
    std::rotate(known, known + 1, unpacked_.end());
    return *unpacked_.back().chunk;
  }
  const Chunk& chunk = chunks_.at(position);
  std::size_t bytes = chunk.size;
  for (const Unpacked& entry : unpacked_) bytes += entry.chunk->size();
  while (!unpacked_.empty() && (unpacked_.size() >= kMostUnpacked || bytes > kMostUnpackedBytes)) {
    bytes -= unpacked_.front().chunk->size();
    unpacked_.erase(unpacked_.begin());
  }
  Bytes packed = read(chunk.data_at, chunk.data_size, "a chunk");
  try {
    Bytes unpacked = unpack(chunk.packing, std::move(packed), chunk.size);
    unpacked_.push_back({position, std::make_unique<BagChunk>(std::move(unpacked))});
  } catch (const BagDamage& damage) {
    fail("the chunk at byte " + std::to_string(position) + " " + damage.what());
  }
  return *unpacked_.back().chunk;
}

std::optional<RecordedFile::Item> BagReader::next() {
  if (next_ == entries_.size()) return std::nullopt;
  const Entry& entry = entries_[next_++];
  return Item{entry.connection, entry.received, message(entry)};
}

Bytes BagReader::message(const Entry& entry) {
  const BagChunk& chunk = this->chunk(entry.chunk);
  const BagChunk::Message* message = chunk.find(entry.offset);
  if (!message || message->connection != entry.connection) {
    fail("the index names a message at byte " + std::to_string(entry.offset) +
         " of the chunk at byte " + std::to_string(entry.chunk) + ", where " +
         (message ? "another connection's is" : "none is"));
  }
  // A reader that believed the index would put the message elsewhere in the order of all.
  if (message->time && message->received() != entry.received) {
    fail("the index has another time for the message at byte " + std::to_string(entry.offset) +
         " of the chunk at byte " + std::to_string(entry.chunk) +
         " than the message itself; 'rosbag reindex' makes a new index");
  }
  return chunk.data(*message);
}

}  // namespace afterglow::replay

#include "replay/bags/mcap_writer.hpp"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>

#include "replay/bags/bag_file.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kChunkBytes = 1 << 20;  ///< size of records, unless one message is larger

/// A record: its fields, then its length in front of them.
class RecordBytes {
 public:
  explicit RecordBytes(McapRecord kind) : bytes_(kMcapRecordHeader) {
    bytes_[0] = static_cast<std::uint8_t>(kind);
  }

  template <typename T>
  RecordBytes& number(T value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    storeNumber(bytes_.data() + at, value);
    return *this;
  }
  RecordBytes& string(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size()));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    return *this;
  }
  RecordBytes& strings(const std::map<std::string, std::string>& map) {
    const std::size_t at = bytes_.size();
    number(std::uint32_t{0});
    for (const auto& [key, value] : map) string(key).string(value);
    storeNumber(bytes_.data() + at, static_cast<std::uint32_t>(bytes_.size() - at - 4));
    return *this;
  }
  RecordBytes& add(const Bytes& bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }
  Bytes take() {
    storeNumber(bytes_.data() + 1, static_cast<std::uint64_t>(bytes_.size() - kMcapRecordHeader));
    return std::move(bytes_);
  }

 private:
  Bytes bytes_;
};

std::uint32_t checksumWith(std::uint32_t checksum, const Bytes& bytes) {
  // zlib takes "no bytes" for the wish to begin anew.
  if (bytes.empty()) return checksum;
  return static_cast<std::uint32_t>(crc32_z(checksum, bytes.data(), bytes.size()));
}

const char* nameOf(Packing packing) {
  if (packing == Packing::Lz4) return "lz4";
  return packing == Packing::Zstd ? "zstd" : "";
}

}  // namespace

void McapWriter::Interval::add(std::uint64_t time) {
  begin = is_empty ? time : std::min(begin, time);
  end = is_empty ? time : std::max(end, time);
  is_empty = false;
}

McapWriter::McapWriter(const std::string& path, std::string name, const std::string& profile,
                       Packing packing)
    : name_(std::move(name)),
      packing_(packing),
      file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
  if (file_ < 0) fail(std::strerror(errno));
  put(Bytes(kMcapMagic.begin(), kMcapMagic.end()));
  put(RecordBytes(McapRecord::Header).string(profile).string("afterglow").take());
}

McapWriter::~McapWriter() {
  if (file_ >= 0) ::close(file_);
}

void McapWriter::fail(const std::string& reason) const {
  throw BagError(name_ + ": cannot write the MCAP file: " + reason);
}

void McapWriter::put(const Bytes& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t written = ::write(file_, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(std::strerror(errno));
    done += static_cast<std::size_t>(written);
  }
  size_ += bytes.size();
  checksum_ = checksumWith(checksum_, bytes);
}

std::uint16_t McapWriter::addSchema(const McapSchema& schema) {
  if (schemas_.size() >= std::numeric_limits<std::uint16_t>::max()) fail("too many types");
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);  // 0 means none
  schemas_.push_back(RecordBytes(McapRecord::Schema)
                         .number(id)
                         .string(schema.name)
                         .string(schema.encoding)
                         .string(schema.text)
                         .take());
  append(chunk_, schemas_.back());
  return id;
}

std::uint16_t McapWriter::addChannel(const McapChannel& channel) {
  if (channels_.size() >= std::numeric_limits<std::uint16_t>::max()) fail("too many channels");
  const auto id = static_cast<std::uint16_t>(channels_.size());
  channels_.push_back(RecordBytes(McapRecord::Channel)
                          .number(id)
                          .number(channel.schema)
                          .string(channel.topic)
                          .string(channel.encoding)
                          .strings(channel.metadata)
                          .take());
  append(chunk_, channels_.back());
  return id;
}

void McapWriter::write(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time,
                       const Bytes& data) {
  chunk_index_[channel].emplace_back(log_time, chunk_.size());
  append(chunk_, RecordBytes(McapRecord::Message)
                     .number(channel)
                     .number(sequence)
                     .number(log_time)
                     .number(log_time)  // the publish time, which is not known
                     .add(data)
                     .take());
  chunk_times_.add(log_time);
  times_.add(log_time);
  ++counts_[channel];
  ++message_count_;
  if (chunk_.size() >= kChunkBytes) endChunk();
}

void McapWriter::addMetadata(const std::string& name,
                             const std::map<std::string, std::string>& entries) {
  endChunk();
  const std::uint64_t at = size_;
  put(RecordBytes(McapRecord::Metadata).string(name).strings(entries).take());
  metadata_indexes_.push_back(
      RecordBytes(McapRecord::MetadataIndex).number(at).number(size_ - at).string(name).take());
}

void McapWriter::endChunk() {
  if (chunk_.empty()) return;
  Bytes packed;
  try {
    packed = pack(packing_, chunk_);
  } catch (const BagDamage& damage) {
    fail(std::string("it ") + damage.what());
  }
  const std::uint64_t chunk_at = size_;
  put(RecordBytes(McapRecord::Chunk)
          .number(chunk_times_.begin)
          .number(chunk_times_.end)
          .number(static_cast<std::uint64_t>(chunk_.size()))
          .number(checksumWith(0, chunk_))
          .string(nameOf(packing_))
          .number(static_cast<std::uint64_t>(packed.size()))
          .add(packed)
          .take());
  const std::uint64_t chunk_end = size_;
  RecordBytes offsets(McapRecord::ChunkIndex);
  offsets.number(chunk_times_.begin)
      .number(chunk_times_.end)
      .number(chunk_at)
      .number(chunk_end - chunk_at)
      .number(static_cast<std::uint32_t>(chunk_index_.size() * 10));
  for (const auto& [channel, entries] : chunk_index_) {
    offsets.number(channel).number(size_);
    RecordBytes index(McapRecord::MessageIndex);
    index.number(channel).number(static_cast<std::uint32_t>(entries.size() * 16));
    for (const auto& [time, offset] : entries) index.number(time).number(offset);
    put(index.take());
  }
  chunk_indexes_.push_back(offsets.number(size_ - chunk_end)
                               .string(nameOf(packing_))
                               .number(static_cast<std::uint64_t>(packed.size()))
                               .number(static_cast<std::uint64_t>(chunk_.size()))
                               .take());
  chunk_.clear();
  chunk_index_.clear();
  chunk_times_ = {};
}

void McapWriter::putSummary() {
  RecordBytes statistics(McapRecord::Statistics);
  statistics.number(message_count_)
      .number(static_cast<std::uint16_t>(schemas_.size()))
      .number(static_cast<std::uint32_t>(channels_.size()))
      .number(std::uint32_t{0})  // attachments
      .number(static_cast<std::uint32_t>(metadata_indexes_.size()))
      .number(static_cast<std::uint32_t>(chunk_indexes_.size()))
      .number(times_.begin)
      .number(times_.end)
      .number(static_cast<std::uint32_t>(counts_.size() * 10));
  for (const auto& [channel, count] : counts_) statistics.number(channel).number(count);
  const std::vector<Bytes> all_statistics{statistics.take()};
  const std::uint64_t summary_at = size_;
  checksum_ = 0;
  std::vector<Bytes> groups;
  const std::vector<Bytes>* const groups_of_records[] = {
      &schemas_, &channels_, &all_statistics, &chunk_indexes_, &metadata_indexes_};
  for (const auto* records : groups_of_records) {
    if (records->empty()) continue;
    const std::uint64_t begin = size_;
    for (const Bytes& record : *records) put(record);
    groups.push_back(RecordBytes(McapRecord::SummaryOffset)
                         .number(records->front()[0])
                         .number(begin)
                         .number(size_ - begin)
                         .take());
  }
  const std::uint64_t offsets_at = size_;
  for (const Bytes& group : groups) put(group);
  // The checksum covers the footer up to itself.
  Bytes footer = RecordBytes(McapRecord::Footer)
                     .number(summary_at)
                     .number(offsets_at)
                     .number(std::uint32_t{0})
                     .take();
  const std::uint32_t checksum =
      checksumWith(checksum_, Bytes(footer.begin(), footer.end() - sizeof(std::uint32_t)));
  storeNumber(footer.data() + footer.size() - sizeof(checksum), checksum);
  put(footer);
}

void McapWriter::close() {
  endChunk();
  put(RecordBytes(McapRecord::DataEnd).number(checksum_).take());
  putSummary();
  put(Bytes(kMcapMagic.begin(), kMcapMagic.end()));
  if (::fsync(file_) != 0) fail(std::strerror(errno));
  const int file = std::exchange(file_, -1);
  if (::close(file) != 0) fail(std::strerror(errno));
}

}  // namespace afterglow::replay

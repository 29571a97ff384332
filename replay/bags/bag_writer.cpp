// Writes bags of ROS 1, format 2.0. Source of the format: wiki.ros.org/Bags/Format/2.0.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/bag_reader.hpp"
#include "replay/bags/export_file.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kBagChunkBytes = 768 << 10;  ///< size; one message may be larger
/// The bag's header is written again at the end: what follows it begins there.
constexpr std::size_t kBagHeaderBytes = 4096;

template <typename T>
void appendNumber(Bytes& to, T value) {
  to.resize(to.size() + sizeof(T));
  storeNumber(to.data() + to.size() - sizeof(T), value);
}

/// The fields of a header.
class Header {
 public:
  Header() = default;
  explicit Header(BagRecord kind) { number("op", static_cast<std::uint8_t>(kind)); }

  Header& text(std::string_view name, std::string_view value) {
    appendNumber(bytes_, static_cast<std::uint32_t>(name.size() + 1 + value.size()));
    bytes_.insert(bytes_.end(), name.begin(), name.end());
    bytes_.push_back('=');
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    return *this;
  }
  template <typename T>
  Header& number(std::string_view name, T value) {
    char bytes[sizeof(T)];
    storeNumber(reinterpret_cast<std::uint8_t*>(bytes), value);
    return text(name, {bytes, sizeof(T)});
  }
  const Bytes& bytes() const { return bytes_; }
  Bytes record(const Bytes& data) const {
    Bytes record;
    record.reserve(8 + bytes_.size() + data.size());
    appendNumber(record, static_cast<std::uint32_t>(bytes_.size()));
    append(record, bytes_);
    appendNumber(record, static_cast<std::uint32_t>(data.size()));
    append(record, data);
    return record;
  }

 private:
  Bytes bytes_;
};

const char* compressionName(Packing packing) {
  if (packing == Packing::Bz2) return "bz2";
  return packing == Packing::Lz4 ? "lz4" : "none";
}

Bytes connectionRecord(std::uint32_t id, const Channel& channel) {
  Header about;
  about.text("topic", channel.topic).text("type", channel.type).text("md5sum", channel.md5);
  about.text("message_definition", channel.definition);
  about.text("latching", channel.latching ? "1" : "0");
  if (!channel.caller_id.empty()) about.text("callerid", channel.caller_id);
  return Header(BagRecord::Connection)
      .number("conn", id)
      .text("topic", channel.topic)
      .record(about.bytes());
}

class BagWriter : public ExportFile {
 public:
  BagWriter(const std::string& path, Packing packing)
      : ExportFile(path), packing_(packing), file_(partial(), std::ios::binary) {
    if (!file_) fail(std::strerror(errno));
    const std::string_view first_line = "#ROSBAG V2.0\n";
    put(Bytes(first_line.begin(), first_line.end()));
    header_at_ = size_;
    put(bagHeader(0));
  }

  void write(const Message& message, const Channel& channel) override {
    const std::uint64_t time = timeOf(message.received);
    if (message.received.ns == 0) ++unstamped_;
    const auto [known, is_new] =
        ids_.try_emplace(message.channel, static_cast<std::uint32_t>(ids_.size()));
    const std::uint32_t id = known->second;
    if (is_new) {
      connections_.push_back(connectionRecord(id, channel));
      append(chunk_, connections_.back());
    }
    Bytes& index = index_[id];
    appendNumber(index, time);
    appendNumber(index, static_cast<std::uint32_t>(chunk_.size()));
    const bool is_first = index_.size() == 1 && index.size() == kIndexEntry;
    begin_ = is_first ? message.received : std::min(begin_, message.received);
    end_ = is_first ? message.received : std::max(end_, message.received);
    append(chunk_, Header(BagRecord::MessageData)
                       .number("conn", id)
                       .number("time", time)
                       .record(message.bytes));
    if (chunk_.size() >= kBagChunkBytes) endChunk();
  }

  std::uint64_t size() const override { return size_ + chunk_.size(); }
  std::uint64_t unstamped() const override { return unstamped_; }

  void close() override {
    endChunk();
    const std::uint64_t index_at = size_;
    for (const Bytes& record : connections_) put(record);
    for (const Bytes& record : chunk_infos_) put(record);
    file_.seekp(static_cast<std::streamoff>(header_at_));
    put(bagHeader(index_at));
    file_.close();
    if (!file_) fail(std::strerror(errno));
    sync();
  }

 private:
  static constexpr std::size_t kIndexEntry = 12;  ///< bytes: time, offset

  [[noreturn]] void fail(const std::string& reason) const {
    throw BagError(path() + ": cannot write the bag: " + reason);
  }

  void put(const Bytes& bytes) {
    file_.write(reinterpret_cast<const char*>(bytes.data()),
                static_cast<std::streamsize>(bytes.size()));
    if (!file_) fail(std::strerror(errno));
    size_ += bytes.size();
  }

  /// `index_at` is 0 while the bag is not closed.
  Bytes bagHeader(std::uint64_t index_at) const {
    const Header header =
        Header(BagRecord::BagHeader)
            .number("index_pos", index_at)
            .number("conn_count", static_cast<std::uint32_t>(ids_.size()))
            .number("chunk_count", static_cast<std::uint32_t>(chunk_infos_.size()));
    return header.record(Bytes(kBagHeaderBytes - header.bytes().size(), ' '));
  }

  /// Seconds, and nanoseconds above them. A bag takes no earlier time than 1 ns.
  std::uint64_t timeOf(Stamp stamp) const {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    if (stamp.ns < 0 || stamp.ns / kSecond_ns > std::numeric_limits<std::uint32_t>::max()) {
      throw BagError(path() + ": a bag cannot hold the stamp " + std::to_string(stamp.ns) + " ns");
    }
    const auto ns = static_cast<std::uint64_t>(std::max<std::int64_t>(1, stamp.ns));
    return ns / kSecond_ns | ns % kSecond_ns << 32;
  }

  void endChunk() {
    if (chunk_.empty()) return;
    const std::uint64_t chunk_at = size_;
    const auto chunk_size = static_cast<std::uint32_t>(chunk_.size());
    try {
      put(Header(BagRecord::Chunk)
              .text("compression", compressionName(packing_))
              .number("size", chunk_size)
              .record(pack(packing_, chunk_)));
    } catch (const BagDamage& damage) {
      fail(std::string("it ") + damage.what());
    }
    Bytes counts;
    for (const auto& [id, index] : index_) {
      const auto count = static_cast<std::uint32_t>(index.size() / kIndexEntry);
      put(Header(BagRecord::IndexData)
              .number("ver", std::uint32_t{1})
              .number("conn", id)
              .number("count", count)
              .record(index));
      appendNumber(counts, id);
      appendNumber(counts, count);
    }
    chunk_infos_.push_back(Header(BagRecord::ChunkInfo)
                               .number("ver", std::uint32_t{1})
                               .number("chunk_pos", chunk_at)
                               .number("start_time", timeOf(begin_))
                               .number("end_time", timeOf(end_))
                               .number("count", static_cast<std::uint32_t>(index_.size()))
                               .record(counts));
    chunk_.clear();
    index_.clear();
  }

  const Packing packing_;
  std::ofstream file_;
  std::uint64_t size_ = 0, header_at_ = 0;
  std::uint64_t unstamped_ = 0;
  Bytes chunk_;
  std::map<std::uint32_t, Bytes> index_;          ///< entries of the chunk, by connection
  Stamp begin_, end_;                             ///< stamps of the chunk
  std::map<std::int64_t, std::uint32_t> ids_;     ///< connections, by the store's channel
  std::vector<Bytes> connections_, chunk_infos_;  ///< records of connections and chunks
};

}  // namespace

std::unique_ptr<ExportFile> writeRosbag(const std::string& path, Packing packing) {
  return std::make_unique<BagWriter>(path, packing);
}

}  // namespace afterglow::replay

#include <console_bridge/console.h>
#include <rosbag/bag.h>

#include <cstring>
#include <filesystem>
#include <limits>
#include <map>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/export_file.hpp"

namespace afterglow::replay {
namespace {

/// Silences rosbag_storage, which logs to stderr what it also throws. Restores the log level when
/// it goes.
class QuietConsole {
 public:
  QuietConsole() : previous_(console_bridge::getLogLevel()) {
    console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_NONE);
  }
  QuietConsole(const QuietConsole&) = delete;
  QuietConsole& operator=(const QuietConsole&) = delete;
  ~QuietConsole() { console_bridge::setLogLevel(previous_); }

 private:
  console_bridge::LogLevel previous_;
};

namespace fs = std::filesystem;

/// A message for rosbag::Bag::write(): bytes with a type.
struct RawMessage {
  const Channel& channel;
  const Bytes& bytes;
};

}  // namespace
}  // namespace afterglow::replay

namespace ros {
namespace message_traits {

template <>
struct MD5Sum<afterglow::replay::RawMessage> {
  static const char* value(const afterglow::replay::RawMessage& m) { return m.channel.md5.c_str(); }
};
template <>
struct DataType<afterglow::replay::RawMessage> {
  static const char* value(const afterglow::replay::RawMessage& m) {
    return m.channel.type.c_str();
  }
};
template <>
struct Definition<afterglow::replay::RawMessage> {
  static const char* value(const afterglow::replay::RawMessage& m) {
    return m.channel.definition.c_str();
  }
};

}  // namespace message_traits
namespace serialization {

template <>
struct Serializer<afterglow::replay::RawMessage> {
  template <typename Stream>
  static void write(Stream& stream, const afterglow::replay::RawMessage& m) {
    if (m.bytes.empty()) return;
    std::memcpy(stream.advance(serializedLength(m)), m.bytes.data(), m.bytes.size());
  }
  static std::uint32_t serializedLength(const afterglow::replay::RawMessage& m) {
    return static_cast<std::uint32_t>(m.bytes.size());
  }
};

}  // namespace serialization
}  // namespace ros

namespace afterglow::replay {
namespace {

rosbag::CompressionType rosbagCompression(Packing packing) {
  switch (packing) {
    case Packing::Bz2:
      return rosbag::compression::BZ2;
    case Packing::Lz4:
      return rosbag::compression::LZ4;
    case Packing::None:
    case Packing::Zstd:
      break;
  }
  return rosbag::compression::Uncompressed;
}

boost::shared_ptr<ros::M_string> connectionHeader(const Channel& channel) {
  auto header = boost::make_shared<ros::M_string>();
  *header = {{"topic", channel.topic},
             {"type", channel.type},
             {"md5sum", channel.md5},
             {"message_definition", channel.definition},
             {"latching", channel.latching ? "1" : "0"}};
  if (!channel.caller_id.empty()) (*header)["callerid"] = channel.caller_id;
  return header;
}

class RosbagFile : public ExportFile {
 public:
  RosbagFile(const std::string& path, Packing packing) : ExportFile(path) {
    const QuietConsole quiet;
    try {
      bag_ = std::make_unique<rosbag::Bag>(partial(), rosbag::bagmode::Write);
      bag_->setCompression(rosbagCompression(packing));
    } catch (const rosbag::BagException&) {
      fail(std::strerror(errno));
    }
  }
  ~RosbagFile() override {
    if (is_closed_ || !bag_) return;
    const QuietConsole quiet;
    std::error_code ignored;
    // An empty file has room for the index that close() writes even when the disk is full.
    fs::resize_file(partial(), 0, ignored);
    try {
      bag_->close();
    } catch (const rosbag::BagException&) {
      // Its destructor would try to write the index again, throw, and end the process.
      static_cast<void>(bag_.release());
    }
  }

  void write(const Message& message, const Channel& channel) override {
    if (message.received.ns == 0) ++unstamped_;
    const ros::Time time = rosTime(message.received);
    const QuietConsole quiet;
    const auto [header, is_new] = headers_.try_emplace(message.channel);
    if (is_new) header->second = connectionHeader(channel);
    try {
      bag_->write(channel.topic, time, RawMessage{channel, message.bytes}, header->second);
    } catch (const rosbag::BagException& problem) {
      fail(problem.what());
    }
  }

  std::uint64_t size() const override { return bag_->getSize(); }
  std::uint64_t unstamped() const override { return unstamped_; }

  void close() override {
    const QuietConsole quiet;
    try {
      bag_->close();
    } catch (const rosbag::BagException& problem) {
      fail(problem.what());
    }
    is_closed_ = true;
    sync();
  }

 private:
  [[noreturn]] void fail(const std::string& reason) const {
    throw BagError(path() + ": cannot write the bag: " + reason);
  }

  ros::Time rosTime(Stamp stamp) const {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    if (stamp.ns == 0) return ros::TIME_MIN;  // rosbag takes no earlier one
    if (stamp.ns < 0 || stamp.ns / kSecond_ns > std::numeric_limits<std::uint32_t>::max()) {
      throw BagError(path() + ": a bag cannot hold the stamp " + std::to_string(stamp.ns) + " ns");
    }
    return {static_cast<std::uint32_t>(stamp.ns / kSecond_ns),
            static_cast<std::uint32_t>(stamp.ns % kSecond_ns)};
  }

  std::unique_ptr<rosbag::Bag> bag_;
  bool is_closed_ = false;
  std::uint64_t unstamped_ = 0;
  /// Headers by the store's channel.
  std::map<std::int64_t, boost::shared_ptr<ros::M_string>> headers_;
};

}  // namespace

std::unique_ptr<ExportFile> writeRosbag(const std::string& path, Packing packing) {
  return std::make_unique<RosbagFile>(path, packing);
}

}  // namespace afterglow::replay

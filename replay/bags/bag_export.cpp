#include <console_bridge/console.h>
#include <fcntl.h>
#include <rosbag/bag.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <map>
#include <set>

#include "replay/bags/bag_file.hpp"

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

constexpr std::uint64_t kProgressEvery = 1000;

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

rosbag::CompressionType rosbagCompression(BagCompression compression) {
  switch (compression) {
    case BagCompression::Bz2:
      return rosbag::compression::BZ2;
    case BagCompression::Lz4:
      return rosbag::compression::LZ4;
    case BagCompression::None:
      break;
  }
  return rosbag::compression::Uncompressed;
}

/// A bag under a temporary name until it is complete; removed if it is never completed.
class BagWriter {
 public:
  BagWriter(const std::string& path, BagCompression compression)
      : path_(path), partial_(path + ".part" + std::to_string(getpid())) {
    try {
      bag_ = std::make_unique<rosbag::Bag>(partial_, rosbag::bagmode::Write);
      bag_->setCompression(rosbagCompression(compression));
    } catch (const rosbag::BagException&) {
      const std::string reason = std::strerror(errno);
      std::error_code ignored;
      fs::remove(partial_, ignored);
      throw BagError(path_ + ": cannot write the bag: " + reason);
    }
  }
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;
  ~BagWriter() {
    if (!bag_) return;
    std::error_code ignored;
    // An empty file has room for the index that close() writes even when the disk is full.
    fs::resize_file(partial_, 0, ignored);
    try {
      bag_->close();
    } catch (const rosbag::BagException&) {
      // Its destructor would try to write the index again, throw, and end the process.
      static_cast<void>(bag_.release());
    }
    fs::remove(partial_, ignored);
  }

  void write(const Message& message, const Channel& channel,
             const boost::shared_ptr<ros::M_string>& header) {
    bag_->write(channel.topic, rosTime(message.received), RawMessage{channel, message.bytes},
                header);
  }

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return bag_->getSize(); }  ///< approximately

  /// Ends writing; publish() then moves the bag to path().
  void close() {
    bag_->close();
    sync(partial_);
  }

  void publish() {
    std::error_code error;
    fs::rename(partial_, path_, error);
    if (error) throw BagError(path_ + ": cannot write the bag: " + error.message());
    bag_.reset();
  }

 private:
  ros::Time rosTime(Stamp stamp) const {
    constexpr std::int64_t second_ns = 1'000'000'000;
    if (stamp.ns <= 0 || stamp.ns / second_ns > std::numeric_limits<std::uint32_t>::max()) {
      throw BagError(path_ + ": a bag cannot hold the stamp " + std::to_string(stamp.ns) + " ns");
    }
    return {static_cast<std::uint32_t>(stamp.ns / second_ns),
            static_cast<std::uint32_t>(stamp.ns % second_ns)};
  }

  void sync(const std::string& file) const {
    const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    const bool is_synced = descriptor >= 0 && ::fsync(descriptor) == 0;
    const std::string reason = std::strerror(errno);
    if (descriptor >= 0) ::close(descriptor);
    if (!is_synced) throw BagError(path_ + ": cannot write the bag: " + reason);
  }

  std::string path_;
  std::string partial_;
  std::unique_ptr<rosbag::Bag> bag_;
};

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

/// The messages of several behaviors in one order; a message of several behaviors comes once.
class MergedMessages {
 public:
  MergedMessages(const Store& store, const std::vector<Behavior>& behaviors,
                 const MessageRange& range) {
    for (const Behavior& behavior : behaviors) {
      sources_.push_back({behavior.recording, store.messages(behavior, range), {}});
      advance(sources_.size() - 1);
    }
  }

  std::optional<Message> next() {
    while (!heads_.empty()) {
      const Head head = *heads_.begin();
      heads_.erase(heads_.begin());
      const std::size_t source = std::get<3>(head);
      Message message = std::move(*sources_[source].head);
      advance(source);
      const Key key{std::get<0>(head), std::get<1>(head), std::get<2>(head)};
      if (last_ == key) continue;
      last_ = key;
      return message;
    }
    return std::nullopt;
  }

  /// Messages that could not be read.
  std::uint64_t damaged() const {
    std::uint64_t count = 0;
    for (const Source& source : sources_) count += source.cursor->damaged().size();
    return count;
  }

 private:
  using Key = std::tuple<std::int64_t, std::int64_t, std::uint64_t>;  // stamp, recording, sequence
  using Head = std::tuple<std::int64_t, std::int64_t, std::uint64_t, std::size_t>;  // and source
  struct Source {
    std::int64_t recording = 0;
    std::unique_ptr<MessageCursor> cursor;
    std::optional<Message> head;
  };

  void advance(std::size_t index) {
    Source& source = sources_[index];
    source.head = source.cursor->next();
    if (!source.head) return;
    heads_.emplace(source.head->received.ns, source.recording, source.head->sequence, index);
  }

  std::vector<Source> sources_;
  std::set<Head> heads_;
  std::optional<Key> last_;
};

std::uint64_t countSelected(const Store& store, const std::vector<Behavior>& behaviors,
                            const MessageRange& range) {
  std::uint64_t count = 0;
  for (Behavior behavior : behaviors) {
    if (!range.topics.empty() && !range.with_all_topics) behavior.topics = range.topics;
    for (const TopicSummary& topic : store.topics(behavior)) count += topic.count;
    if (!range.with_all_topics) continue;
    for (const TopicSummary& topic : store.contextTopics(behavior)) count += topic.count;
  }
  return count;
}

/// One export: the bags written so far, the last of them open.
class Exporter {
 public:
  Exporter(const Store& store, const std::string& path, const BagExport& options)
      : store_(store), path_(path), options_(options) {
    begin();
  }

  void write(const Message& message) {
    if (options_.split_bytes && bags_.back()->size() >= *options_.split_bytes) {
      bags_.back()->close();
      begin();
    }
    const KnownChannel& known = channel(message.channel);
    bags_.back()->write(message, known.channel, known.header);
  }

  std::vector<std::string> finish() {
    bags_.back()->close();
    std::vector<std::string> paths;
    for (const auto& bag : bags_) {
      bag->publish();
      paths.push_back(bag->path());
    }
    return paths;
  }

 private:
  struct KnownChannel {
    Channel channel;
    boost::shared_ptr<ros::M_string> header;
  };

  void begin() {
    fs::path path = path_;
    if (options_.split_bytes) {
      const std::string name = path.stem().string() + "_" + std::to_string(bags_.size());
      path.replace_filename(name + path.extension().string());
    }
    bags_.push_back(std::make_unique<BagWriter>(path.string(), options_.compression));
  }

  const KnownChannel& channel(std::int64_t id) {
    const auto known = channels_.find(id);
    if (known != channels_.end()) return known->second;
    Channel channel = store_.channel(id);
    auto header = connectionHeader(channel);
    return channels_.emplace(id, KnownChannel{std::move(channel), header}).first->second;
  }

  const Store& store_;
  const std::string& path_;
  const BagExport& options_;
  std::vector<std::unique_ptr<BagWriter>> bags_;
  std::map<std::int64_t, KnownChannel> channels_;
};

BagExportResult writeAll(const Store& store, const std::vector<Behavior>& behaviors,
                         const MessageRange& range, const std::string& path,
                         const BagExport& options) {
  Exporter exporter(store, path, options);
  const std::uint64_t total = options.progress ? countSelected(store, behaviors, range) : 0;
  BagExportResult result;
  MergedMessages messages(store, behaviors, range);
  while (const auto message = messages.next()) {
    exporter.write(*message);
    if (++result.messages % kProgressEvery == 0 && options.progress) {
      options.progress(result.messages, total);
    }
  }
  if (options.progress) options.progress(result.messages, result.messages);
  result.damaged = messages.damaged();
  result.paths = exporter.finish();
  return result;
}

}  // namespace

BagExportResult exportBags(const Store& store, const std::vector<Behavior>& behaviors,
                           const MessageRange& range, const std::string& path,
                           const BagExport& options) {
  const QuietConsole quiet;
  try {
    return writeAll(store, behaviors, range, path, options);
  } catch (const rosbag::BagException& problem) {
    throw BagError(path + ": cannot write the bag: " + problem.what());
  }
}

}  // namespace afterglow::replay

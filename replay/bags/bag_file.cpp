#include "replay/bags/bag_file.hpp"

#include <console_bridge/console.h>
#include <fcntl.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <set>

#include "replay/bags/bag_check.hpp"
#include "replay/messages/field_edit.hpp"

namespace afterglow::replay {
namespace {

namespace fs = std::filesystem;

/// An append ends with the message that reaches one of these.
constexpr std::size_t kBatchMessages = 1000;
constexpr std::size_t kBatchBytes = 8 << 20;
constexpr std::uint64_t kProgressEvery = 1000;

/// rosbag_storage logs to stderr what it also throws; the exception is enough.
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

/// rosbag's constructor that opens a bag leaks what it has read when it throws; its destructor does
/// not.
struct OpenBag {
  explicit OpenBag(const std::string& path) { bag.open(path, rosbag::bagmode::Read); }
  rosbag::Bag bag;
};

/// A view that yields messages of equal stamp in the order they lie in the file; rosbag's own
/// yields them in no particular order. Bag must outlive it.
class OrderedView : public rosbag::View {
 public:
  explicit OrderedView(const rosbag::Bag& bag) : View(bag), bag_(bag) {
    update();
    for (const rosbag::MessageRange* range : ranges_) {
      for (auto entry = range->begin; entry != range->end; ++entry) {
        entries_.push_back({&*entry, range->connection_info});
      }
    }
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
      return std::tie(a.index->time, a.index->chunk_pos, a.index->offset) <
             std::tie(b.index->time, b.index->chunk_pos, b.index->offset);
    });
  }

  struct Entry {
    const rosbag::IndexEntry* index;
    const rosbag::ConnectionInfo* connection;
  };
  const std::vector<Entry>& entries() const { return entries_; }

  Bytes read(const Entry& entry) {
    const std::unique_ptr<rosbag::MessageInstance> message(
        newMessageInstance(entry.connection, *entry.index, bag_));
    Bytes bytes(message->size());
    ros::serialization::OStream stream(bytes.data(), message->size());
    message->write(stream);
    return bytes;
  }

 private:
  const rosbag::Bag& bag_;
  std::vector<Entry> entries_;
};

Stamp stampOf(const ros::Time& time) { return Stamp::fromParts(time.sec, time.nsec); }

std::string headerField(const rosbag::ConnectionInfo& connection, const std::string& name) {
  const auto field = connection.header->find(name);
  return field == connection.header->end() ? std::string() : field->second;
}

Channel channelOf(const rosbag::ConnectionInfo& connection) {
  return {connection.topic,
          connection.datatype,
          connection.md5sum,
          connection.msg_def,
          headerField(connection, "latching") == "1",
          headerField(connection, "callerid")};
}

/// One import: what it has seen of the bag, and the batch it is filling.
class Importer {
 public:
  Importer(const std::string& path, Store& store, const BagImport& import)
      : path_(path), store_(store), import_(import), check_(path), bag_(path), view_(bag_.bag) {
    const auto& entries = view_.entries();
    if (entries.empty()) throw BagError(path_ + ": the bag holds no messages");
    for (const auto& entry : entries)
      check_.checkMessage(entry.index->chunk_pos, entry.index->offset);
  }

  BagImportResult run() {
    recording_ = store_.addRecording({0, "", path_, ""});
    for (const auto& entry : view_.entries()) {
      add(entry);
      if (batch_.size() >= kBatchMessages || batch_bytes_ >= kBatchBytes) flush();
    }
    flush();
    return {addBehavior(), done_, check_.messages() - done_};
  }

 private:
  struct KnownChannel {
    std::int64_t id = 0;
    std::optional<Schema> schema;
  };

  const KnownChannel& channel(const rosbag::ConnectionInfo& connection) {
    const auto known = channels_.find(connection.id);
    if (known != channels_.end()) return known->second;
    const Channel channel = channelOf(connection);
    topics_.insert(channel.topic);
    KnownChannel& added = channels_[connection.id];
    added.id = store_.addChannel(recording_, channel);
    try {
      added.schema = Schema::parse(channel.type, channel.definition);
    } catch (const MessageError&) {
      // Kept as bytes; its messages have no document and no header stamp.
    }
    return added;
  }

  void add(const OrderedView::Entry& entry) {
    const KnownChannel& channel = this->channel(*entry.connection);
    Message message;
    message.channel = channel.id;
    message.received = stampOf(entry.index->time);
    message.sequence = sequence_++;
    message.bytes = view_.read(entry);
    try {
      if (channel.schema) message.header_stamp = headerStamp(*channel.schema, message.bytes);
    } catch (const MessageError&) {
      // As above.
    }
    batch_bytes_ += message.bytes.size();
    batch_.push_back(std::move(message));
  }

  void flush() {
    store_.append(batch_);
    done_ += batch_.size();
    batch_.clear();
    batch_bytes_ = 0;
    if (import_.progress) import_.progress(done_, view_.entries().size());
  }

  Behavior addBehavior() {
    Behavior behavior;
    behavior.recording = recording_;
    behavior.name = import_.name.empty() ? fs::path(path_).stem().string() : import_.name;
    behavior.outcome = "imported";
    behavior.begin = stampOf(view_.entries().front().index->time);
    behavior.end = Stamp{stampOf(view_.entries().back().index->time).ns + 1};
    behavior.tags = import_.tags;
    behavior.topics.assign(topics_.begin(), topics_.end());
    behavior.id = store_.addBehavior(behavior);
    return behavior;
  }

  const std::string& path_;
  Store& store_;
  const BagImport& import_;
  BagCheck check_;
  OpenBag bag_;
  OrderedView view_;
  std::int64_t recording_ = 0;
  std::uint64_t sequence_ = 0, done_ = 0;
  std::map<std::uint32_t, KnownChannel> channels_;  ///< by the bag's id of the connection
  std::set<std::string> topics_;
  std::vector<Message> batch_;
  std::size_t batch_bytes_ = 0;
};

// ----------------------------------------------------------------------------------------- export

/// What rosbag::Bag::write() takes for a message: bytes with a type.
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

/// A bag under a name of its own until it is complete; gone if it never is.
class BagWriter {
 public:
  explicit BagWriter(const std::string& path)
      : path_(path), partial_(path + ".part" + std::to_string(getpid())) {
    try {
      bag_ = std::make_unique<rosbag::Bag>(partial_, rosbag::bagmode::Write);
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

  void finish() {
    bag_->close();
    sync(partial_);
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

std::uint64_t countSelected(const Store& store, const Behavior& behavior,
                            const MessageRange& range) {
  Behavior selection = behavior;
  if (!range.topics.empty()) selection.topics = range.topics;
  std::uint64_t count = 0;
  for (const TopicSummary& topic : store.topics(selection)) count += topic.count;
  return count;
}

std::uint64_t writeAll(const Store& store, const Behavior& behavior, const MessageRange& range,
                       BagWriter& writer, const BagProgress& progress) {
  struct KnownChannel {
    Channel channel;
    boost::shared_ptr<ros::M_string> header;
  };
  std::map<std::int64_t, KnownChannel> channels;
  const std::uint64_t total = progress ? countSelected(store, behavior, range) : 0;
  const auto cursor = store.messages(behavior, range);
  std::uint64_t done = 0;
  while (const auto message = cursor->next()) {
    auto known = channels.find(message->channel);
    if (known == channels.end()) {
      Channel channel = store.channel(message->channel);
      auto header = connectionHeader(channel);
      known = channels.emplace(message->channel, KnownChannel{std::move(channel), header}).first;
    }
    writer.write(*message, known->second.channel, known->second.header);
    if (++done % kProgressEvery == 0 && progress) progress(done, total);
  }
  if (progress) progress(done, total);
  return done;
}

}  // namespace

BagImportResult importBag(const std::string& path, Store& store, const BagImport& import) {
  const QuietConsole quiet;
  try {
    Importer importer(path, store, import);
    BagImportResult result;
    store.transaction([&] { result = importer.run(); });
    return result;
  } catch (const ros::Exception& problem) {
    throw BagError(path + ": cannot read the bag: " + problem.what());
  }
}

std::uint64_t exportBag(const Store& store, const Behavior& behavior, const MessageRange& range,
                        const std::string& path, const BagProgress& progress) {
  const QuietConsole quiet;
  BagWriter writer(path);
  try {
    const std::uint64_t done = writeAll(store, behavior, range, writer, progress);
    writer.finish();
    return done;
  } catch (const rosbag::BagException& problem) {
    throw BagError(path + ": cannot write the bag: " + problem.what());
  }
}

}  // namespace afterglow::replay

#include "replay/bags/export_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/mcap_writer.hpp"
#include "replay/ros2/cdr_conversion.hpp"
#include "replay/store/store_reading.hpp"
#include "replay/store/sqlite/store_files.hpp"

namespace afterglow::replay {

ExportFile::ExportFile(const std::string& path)
    : path_(path), partial_(path + ".part" + std::to_string(getpid())) {}

ExportFile::~ExportFile() {
  if (is_published_) return;
  std::error_code ignored;
  std::filesystem::remove(partial_, ignored);
}

void ExportFile::sync() const {
  const int descriptor = ::open(partial_.c_str(), O_RDONLY | O_CLOEXEC);
  const bool is_synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  const std::string reason = std::strerror(errno);
  if (descriptor >= 0) ::close(descriptor);
  if (!is_synced) throw BagError(path_ + ": cannot write the bag: " + reason);
}

void ExportFile::publish() {
  std::error_code error;
  std::filesystem::rename(partial_, path_, error);
  const int unsynced = error ? 0 : syncName(path_);
  is_published_ = !error;
  if (unsynced != 0) error = std::error_code(unsynced, std::generic_category());
  if (error) throw BagError(path_ + ": cannot write the file: " + error.message());
}

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kProgressEvery = 1000;

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

/// An export: the files written so far, the last of them open.
class Exporter {
 public:
  Exporter(const Store& store, const std::vector<Behavior>& behaviors, const std::string& path,
           const BagExport& options)
      : store_(store), behaviors_(behaviors), path_(path), options_(options) {
    begin();
  }

  void write(const Message& message) {
    if (options_.split_bytes && files_.back()->size() >= *options_.split_bytes) {
      files_.back()->close();
      begin();
    }
    files_.back()->write(message, channels_.channel(message.channel));
  }

  void finish(BagExportResult& result) {
    files_.back()->close();
    for (const auto& file : files_) {
      file->publish();
      result.paths.push_back(file->path());
      result.unstamped += file->unstamped();
    }
  }

 private:
  void begin() {
    fs::path path = path_;
    if (options_.split_bytes) {
      const std::string name = path.stem().string() + "_" + std::to_string(files_.size());
      path.replace_filename(name + path.extension().string());
    }
    const Packing packing = packingOf(options_.compression);
    files_.push_back(options_.format == RecordingFormat::Mcap
                         ? writeMcap(path.string(), packing, options_.is_ros2, behaviors_)
                         : writeRosbag(path.string(), packing));
  }

  static Packing packingOf(BagCompression compression) {
    switch (compression) {
      case BagCompression::Bz2:
        return Packing::Bz2;
      case BagCompression::Lz4:
        return Packing::Lz4;
      case BagCompression::Zstd:
        return Packing::Zstd;
      case BagCompression::None:
        break;
    }
    return Packing::None;
  }

  const Store& store_;
  const std::vector<Behavior>& behaviors_;
  const std::string& path_;
  const BagExport& options_;
  std::vector<std::unique_ptr<ExportFile>> files_;
  KnownChannels channels_{store_};
};

}  // namespace

RecordingFormat formatOfFile(const std::string& path) {
  return fs::path(path).extension() == ".mcap" ? RecordingFormat::Mcap : RecordingFormat::Rosbag;
}

BagExportResult exportBags(const Store& store, const std::vector<Behavior>& behaviors,
                           const MessageRange& range, const std::string& path,
                           const BagExport& options) {
  Exporter exporter(store, behaviors, path, options);
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
  exporter.finish(result);
  return result;
}

namespace {

std::string toJson(const std::vector<std::string>& texts) {
  return nlohmann::json(texts).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// Returns what Afterglow knows of a behavior beside its messages.
std::map<std::string, std::string> describe(const Behavior& behavior) {
  std::map<std::string, std::string> entries{
      {"id", std::to_string(behavior.id)},
      {"key", behavior.key},
      {"name", behavior.name},
      {"tree_path", behavior.tree_path},
      {"attempt", std::to_string(behavior.attempt)},
      {"outcome", behavior.outcome},
      {"begin_ns", std::to_string(behavior.begin.ns)},
      {"robot", behavior.robot},
      {"parameters", behavior.parameters},
      {"tags", toJson(behavior.tags)},
      {"calibration", behavior.calibration},
      {"topics", toJson(behavior.topics)},
      {"snapshot", behavior.snapshot},
      {"remarks", toJson(behavior.remarks)}};
  if (behavior.parent != 0) entries["parent"] = std::to_string(behavior.parent);
  if (behavior.end) entries["end_ns"] = std::to_string(behavior.end->ns);
  return entries;
}

/// A publisher's quality of service as rosbag2 writes it: its last message is kept for who comes
/// later. Policies are numbers up to Humble, and still read.
constexpr const char* kLatchedQuality =
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n"
    "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n"
    "  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  avoid_ros_namespace_conventions: false";

class McapExport : public ExportFile {
 public:
  McapExport(const std::string& path, Packing packing, bool is_ros2,
             const std::vector<Behavior>& behaviors)
      : ExportFile(path),
        is_ros2_(is_ros2),
        writer_(partial(), path, is_ros2 ? "ros2" : "ros1", packing) {
    for (const Behavior& behavior : behaviors) {
      writer_.addMetadata("afterglow/behavior", describe(behavior));
    }
  }

  void write(const Message& message, const Channel& channel) override {
    if (message.received.ns < 0) {
      throw BagError(path() + ": an MCAP file cannot hold the stamp " +
                     std::to_string(message.received.ns) + " ns");
    }
    const auto sequence = static_cast<std::uint32_t>(message.sequence);
    const auto time = static_cast<std::uint64_t>(message.received.ns);
    try {
      const Output& output = outputOf(message, channel);
      writer_.write(output.id, sequence, time,
                    output.conversion ? output.conversion->toRos2(message.bytes) : message.bytes);
    } catch (const MessageError& error) {
      throw BagError(path() + ": a message of " + channel.topic +
                     " is none of ROS 2's: " + error.what());
    }
  }

  std::uint64_t size() const override { return writer_.size(); }
  void close() override { writer_.close(); }

 private:
  struct Output {
    std::uint16_t id;
    std::optional<CdrConversion> conversion;  ///< of a message of ROS 2
  };

  const Output& outputOf(const Message& message, const Channel& channel) {
    const auto known = outputs_.find(message.channel);
    if (known != outputs_.end()) return known->second;
    return outputs_.emplace(message.channel, is_ros2_ ? ros2Output(channel) : ros1Output(channel))
        .first->second;
  }

  Output ros1Output(const Channel& channel) {
    // Named as a connection header's fields.
    McapChannel added{schemaOf({channel.type, "ros1msg", channel.definition}),
                      channel.topic,
                      "ros1",
                      {{"md5sum", channel.md5}}};
    if (channel.latching) added.metadata["latching"] = "1";
    if (!channel.caller_id.empty()) added.metadata["callerid"] = channel.caller_id;
    return {writer_.addChannel(added), std::nullopt};
  }

  Output ros2Output(const Channel& channel) {
    const auto layouts = ros2Layouts(channel.type, {channel.definition, channel.md5});
    const std::string& text = layouts.empty() ? channel.definition : layouts.front();
    McapChannel added{
        schemaOf({ros2TypeName(channel.type), "ros2msg", ros2Definition(channel.type, text)}),
        channel.topic,
        "cdr",
        {}};
    if (channel.latching) added.metadata["offered_qos_profiles"] = kLatchedQuality;
    return {writer_.addChannel(added),
            CdrConversion(Schema::parse(channel.type, text), Schema::of(channel))};
  }

  std::uint16_t schemaOf(const McapSchema& schema) {
    const auto [known, is_new] = schemas_.try_emplace(std::pair(schema.name, schema.text), 0);
    if (is_new) known->second = writer_.addSchema(schema);
    return known->second;
  }

  const bool is_ros2_;
  McapWriter writer_;
  /// Ids by type, definition.
  std::map<std::pair<std::string, std::string>, std::uint16_t> schemas_;
  std::map<std::int64_t, Output> outputs_;  ///< outputs by the store's channel
};

}  // namespace

std::unique_ptr<ExportFile> writeMcap(const std::string& path, Packing packing, bool is_ros2,
                                      const std::vector<Behavior>& behaviors) {
  return std::make_unique<McapExport>(path, packing, is_ros2, behaviors);
}

}  // namespace afterglow::replay

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <tuple>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/export_file.hpp"
#include "replay/store/store_reading.hpp"

namespace afterglow::replay {
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

}  // namespace afterglow::replay

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/recorded_file.hpp"
#include "replay/messages/field_edit.hpp"
#include "replay/record/snapshot.hpp"
#include "replay/store/store_import.hpp"

namespace afterglow::replay {
namespace {

namespace fs = std::filesystem;

/// The state of one import.
class Importer {
 public:
  Importer(const std::vector<std::string>& paths, Store& store, const BagImport& import)
      : store_(store), import_(import), source_(fmt::format("{}", fmt::join(paths, ", "))) {
    for (const std::string& path : paths) {
      for (auto& file : openRecording(path)) {
        total_ += file->total();
        parts_.push_back({std::move(file), nameOf(path)});
      }
    }
    // Parts of one recording, in any order on the command line.
    std::stable_sort(parts_.begin(), parts_.end(), [](const Part& a, const Part& b) {
      return a.file->begin() < b.file->begin();
    });
  }

  BagImportResult run() {
    StoreImport import(store_, source_);
    recording_ = import.recording();
    AppendBatch batch(store_, [&](std::uint64_t done) {
      if (import_.progress) import_.progress(done, total_);
    });
    BagImportResult result;
    for (const Part& part : parts_) {
      channels_.clear();
      while (auto item = part.file->next()) batch.add(message(*part.file, std::move(*item)));
      std::vector<std::string> remarks = part.file->remarks();
      if (const std::string why = part.file->whyIncomplete(); !why.empty()) {
        is_whole_ = false;
        remarks.push_back(why);
      }
      for (const std::string& remark : remarks) {
        result.remarks.push_back(part.file->path() + ": " + remark);
      }
    }
    batch.flush();
    remarks_ = result.remarks;
    result.messages = batch.done();
    if (result.messages == 0) throw BagError(whyNothing(result.remarks));
    import.finish([&] { result.behavior = addBehavior(); });
    return result;
  }

 private:
  struct KnownChannel {
    std::int64_t id = 0;
    std::optional<Schema> schema;
  };

  struct Part {
    std::unique_ptr<RecordedFile> file;
    std::string name;  ///< name of a behavior that is made of it
  };

  static std::string nameOf(const std::string& path) {
    fs::path named = fs::path(path).lexically_normal();
    if (named.filename().empty()) named = named.parent_path();  // "folder/"
    std::error_code ignored;
    return (fs::is_directory(named, ignored) ? named.filename() : named.stem()).string();
  }

  std::string whyNothing(const std::vector<std::string>& remarks) const {
    std::string why = source_ + ": the bag holds no messages";
    if (!remarks.empty()) why = fmt::format("{}; {}", why + " that can be read", remarks.front());
    return why;
  }

  const KnownChannel& channelOf(const RecordedFile& file, std::uint32_t id) {
    const auto known = channels_.find(id);
    if (known != channels_.end()) return known->second;
    const Channel& channel = file.channel(id);
    topics_.insert(channel.topic);
    if (!channel.caller_id.empty()) {
      TopicNodes& around = snapshot_.nodes[channel.topic];
      around.type = channel.type;
      around.publishers.insert(channel.caller_id);
    }
    KnownChannel& added = channels_[id];
    added.id = store_.addChannel(recording_, channel);
    try {
      added.schema = Schema::of(channel);
    } catch (const MessageError&) {
      // Its messages are kept as bytes, without document and header stamp.
    }
    return added;
  }

  Message message(const RecordedFile& file, RecordedFile::Item&& item) {
    const KnownChannel& channel = channelOf(file, item.channel);
    Message message;
    message.channel = channel.id;
    message.received = item.received;
    message.sequence = sequence_++;
    message.bytes = std::move(item.bytes);
    first_ = sequence_ == 1 ? item.received : std::min(first_, item.received);
    last_ = sequence_ == 1 ? item.received : std::max(last_, item.received);
    try {
      if (channel.schema) message.header_stamp = headerStamp(*channel.schema, message.bytes);
    } catch (const MessageError&) {
      // The message is kept as bytes, too.
    }
    return message;
  }

  Behavior addBehavior() {
    Behavior behavior;
    behavior.recording = recording_;
    behavior.name = import_.name.empty() ? parts_.front().name : import_.name;
    behavior.outcome = is_whole_ ? "imported" : kIncomplete;
    behavior.remarks = remarks_;
    behavior.begin = first_;
    behavior.end = Stamp{last_.ns + 1};
    behavior.tags = import_.tags;
    behavior.topics.assign(topics_.begin(), topics_.end());
    behavior.snapshot = snapshot_.toJson();
    behavior.id = store_.addBehavior(behavior);
    return behavior;
  }

  Store& store_;
  const BagImport& import_;
  std::vector<Part> parts_;  ///< parts by their first stamps
  std::string source_;
  std::uint64_t total_ = 0;
  std::int64_t recording_ = 0;
  std::uint64_t sequence_ = 0;
  Stamp first_, last_;                              ///< stamps of all messages
  std::map<std::uint32_t, KnownChannel> channels_;  ///< channels by the current file's id
  std::set<std::string> topics_;
  Snapshot snapshot_;
  bool is_whole_ = true;
  std::vector<std::string> remarks_;
};

}  // namespace

BagImportResult importBags(const std::vector<std::string>& paths, Store& store,
                           const BagImport& import) {
  if (paths.empty()) throw std::logic_error("importBags: no files");
  return Importer(paths, store, import).run();
}

BagSummary summarizeBag(const std::string& path, const BagProgress& progress) {
  BagSummary summary;
  std::map<std::pair<std::string, std::string>, TopicSummary> topics;
  const auto files = openRecording(path);
  std::uint64_t total = 0;
  for (const auto& file : files) total += file->total();
  for (const auto& file : files) {
    while (const auto item = file->next()) {
      const Channel& channel = file->channel(item->channel);
      TopicSummary& topic = topics[{channel.topic, channel.type}];
      if (topic.count == 0)
        topic = {channel.topic, channel.type, 0, item->received, item->received};
      if (summary.messages == 0) summary.first = summary.last = item->received;
      for (Stamp* first : {&topic.first, &summary.first}) *first = std::min(*first, item->received);
      for (Stamp* last : {&topic.last, &summary.last}) *last = std::max(*last, item->received);
      ++topic.count;
      ++summary.messages;
      if (progress) progress(summary.messages, total);
    }
    for (const std::string& remark : file->remarks()) summary.remarks.push_back(remark);
    const std::string why = file->whyIncomplete();
    if (!why.empty()) summary.remarks.push_back(file->path() + ": " + why);
  }
  for (auto& [name, topic] : topics) summary.topics.push_back(std::move(topic));
  return summary;
}

}  // namespace afterglow::replay

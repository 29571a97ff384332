#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/bag_reader.hpp"
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
      bags_.push_back(std::make_unique<BagReader>(path));
      if (bags_.back()->entries().empty()) throw BagError(path + ": the bag holds no messages");
      total_ += bags_.back()->entries().size();
    }
    // Parts of one recording, in any order on the command line.
    std::stable_sort(bags_.begin(), bags_.end(),
                     [](const auto& a, const auto& b) { return beginOf(*a) < beginOf(*b); });
  }

  BagImportResult run() {
    StoreImport import(store_, source_);
    recording_ = import.recording();
    AppendBatch batch(store_, [&](std::uint64_t done) {
      if (import_.progress) import_.progress(done, total_);
    });
    BagImportResult result;
    for (const auto& bag : bags_) {
      channels_.clear();
      for (const auto& entry : bag->entries()) batch.add(message(*bag, entry));
      result.unstamped += bag->unstamped();
    }
    batch.flush();
    result.messages = batch.done();
    import.finish([&] { result.behavior = addBehavior(); });
    return result;
  }

 private:
  struct KnownChannel {
    std::int64_t id = 0;
    std::optional<Schema> schema;
  };

  static Stamp beginOf(const BagReader& bag) { return bag.entries().front().received; }

  const KnownChannel& channelOf(const BagReader& bag, std::uint32_t connection) {
    const auto known = channels_.find(connection);
    if (known != channels_.end()) return known->second;
    const Channel& channel = bag.channel(connection);
    topics_.insert(channel.topic);
    if (!channel.caller_id.empty()) {
      TopicNodes& around = snapshot_.nodes[channel.topic];
      around.type = channel.type;
      around.publishers.insert(channel.caller_id);
    }
    KnownChannel& added = channels_[connection];
    added.id = store_.addChannel(recording_, channel);
    try {
      added.schema = Schema::parse(channel.type, channel.definition);
    } catch (const MessageError&) {
      // Its messages are kept as bytes, without document and header stamp.
    }
    return added;
  }

  Message message(BagReader& bag, const BagReader::Entry& entry) {
    const KnownChannel& channel = channelOf(bag, entry.connection);
    Message message;
    message.channel = channel.id;
    message.received = entry.received;
    message.sequence = sequence_++;
    message.bytes = bag.read(entry);
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
    behavior.name =
        import_.name.empty() ? fs::path(bags_.front()->path()).stem().string() : import_.name;
    behavior.outcome = "imported";
    behavior.begin = beginOf(*bags_.front());
    Stamp last = behavior.begin;
    for (const auto& bag : bags_) last = std::max(last, bag->entries().back().received);
    behavior.end = Stamp{last.ns + 1};
    behavior.tags = import_.tags;
    behavior.topics.assign(topics_.begin(), topics_.end());
    behavior.snapshot = snapshot_.toJson();
    behavior.id = store_.addBehavior(behavior);
    return behavior;
  }

  Store& store_;
  const BagImport& import_;
  std::vector<std::unique_ptr<BagReader>> bags_;  ///< by their first stamps
  std::string source_;
  std::uint64_t total_ = 0;
  std::int64_t recording_ = 0;
  std::uint64_t sequence_ = 0;
  std::map<std::uint32_t, KnownChannel> channels_;  ///< by the current bag's id of the connection
  std::set<std::string> topics_;
  Snapshot snapshot_;
};

}  // namespace

BagImportResult importBags(const std::vector<std::string>& paths, Store& store,
                           const BagImport& import) {
  if (paths.empty()) throw std::logic_error("importBags: no bags");
  return Importer(paths, store, import).run();
}

}  // namespace afterglow::replay

#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "replay/bags/bag_check.hpp"
#include "replay/bags/bag_file.hpp"
#include "replay/bags/quiet_console.hpp"
#include "replay/messages/field_edit.hpp"
#include "replay/store/append_batch.hpp"

namespace afterglow::replay {
namespace {

namespace fs = std::filesystem;

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

/// A bag that was looked over, open.
class CheckedBag {
 public:
  /// Throws BagError for one that cannot be read or holds no messages.
  explicit CheckedBag(const std::string& path) try
      : path_(path), check_(path), bag_(path), view_(bag_.bag) {
    if (entries().empty()) throw BagError(path_ + ": the bag holds no messages");
    for (const auto& entry : entries()) {
      check_.checkMessage(entry.index->chunk_pos, entry.index->offset);
    }
  } catch (const ros::Exception& problem) {
    throw BagError(path + ": cannot read the bag: " + problem.what());
  }

  const std::string& path() const { return path_; }
  const std::vector<OrderedView::Entry>& entries() const { return view_.entries(); }
  Stamp begin() const { return stampOf(entries().front().index->time); }
  Stamp end() const { return {stampOf(entries().back().index->time).ns + 1}; }
  std::uint64_t unstamped() const { return check_.messages() - entries().size(); }

  Bytes read(const OrderedView::Entry& entry) {
    try {
      return view_.read(entry);
    } catch (const ros::Exception& problem) {
      throw BagError(path_ + ": cannot read the bag: " + problem.what());
    }
  }

 private:
  std::string path_;
  BagCheck check_;
  OpenBag bag_;
  OrderedView view_;
};

/// One import: what it has seen of the bags.
class Importer {
 public:
  Importer(const std::vector<std::string>& paths, Store& store, const BagImport& import)
      : store_(store), import_(import) {
    for (const std::string& path : paths) {
      bags_.push_back(std::make_unique<CheckedBag>(path));
      total_ += bags_.back()->entries().size();
      source_ += (source_.empty() ? "" : ", ") + path;
    }
    // Parts of one recording, in whatever order a shell has listed them.
    std::stable_sort(bags_.begin(), bags_.end(),
                     [](const auto& a, const auto& b) { return a->begin() < b->begin(); });
  }

  BagImportResult run() {
    recording_ = store_.addRecording({0, "", source_, ""});
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
    result.behavior = addBehavior();
    return result;
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

  Message message(CheckedBag& bag, const OrderedView::Entry& entry) {
    const KnownChannel& channel = this->channel(*entry.connection);
    Message message;
    message.channel = channel.id;
    message.received = stampOf(entry.index->time);
    message.sequence = sequence_++;
    message.bytes = bag.read(entry);
    try {
      if (channel.schema) message.header_stamp = headerStamp(*channel.schema, message.bytes);
    } catch (const MessageError&) {
      // As above.
    }
    return message;
  }

  Behavior addBehavior() {
    Behavior behavior;
    behavior.recording = recording_;
    behavior.name =
        import_.name.empty() ? fs::path(bags_.front()->path()).stem().string() : import_.name;
    behavior.outcome = "imported";
    behavior.begin = bags_.front()->begin();
    Stamp end = bags_.front()->end();
    for (const auto& bag : bags_) end = std::max(end, bag->end());
    behavior.end = end;
    behavior.tags = import_.tags;
    behavior.topics.assign(topics_.begin(), topics_.end());
    behavior.id = store_.addBehavior(behavior);
    return behavior;
  }

  Store& store_;
  const BagImport& import_;
  std::vector<std::unique_ptr<CheckedBag>> bags_;  ///< by their first stamps
  std::string source_;
  std::uint64_t total_ = 0;
  std::int64_t recording_ = 0;
  std::uint64_t sequence_ = 0;
  std::map<std::uint32_t, KnownChannel> channels_;  ///< by the current bag's id of the connection
  std::set<std::string> topics_;
};

}  // namespace

BagImportResult importBags(const std::vector<std::string>& paths, Store& store,
                           const BagImport& import) {
  if (paths.empty()) throw std::logic_error("importBags: no bags");
  const QuietConsole quiet;
  Importer importer(paths, store, import);
  BagImportResult result;
  store.transaction([&] { result = importer.run(); });
  return result;
}

}  // namespace afterglow::replay

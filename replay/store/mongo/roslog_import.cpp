#include "replay/store/mongo/roslog_import.hpp"

#include <bson/bson.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include "replay/messages/bson_document.hpp"
#include "replay/messages/field_edit.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/text.hpp"
#include "replay/store/mongo/mongo_bson.hpp"
#include "replay/store/mongo/mongo_client.hpp"
#include "replay/store/mongo/mongo_layout.hpp"
#include "replay/store/store_import.hpp"

namespace afterglow::replay {
namespace {

/// The facts beside the message in a document of a mongodb_log database; its writers differ.
/// Source: mongodb_store's util.py, util.h, mongodb_log.py, mongodb_log_tf.cpp, message_store.
struct RoslogFacts {
  /// Logger: mongodb_log in Python, the action server of the paper. CppLogger: of one kind of
  /// message (PointCloud, CompressedImage); it keeps no topic. Afterglow: our own store.
  enum class Writer { Logger, CppLogger, TfLogger, MessageStore, Afterglow };
  Writer writer = Writer::Logger;
  Stamp inserted;     ///< time to the millisecond; the tf logger's to the second
  std::string topic;  ///< absolute; empty if it is not kept
  std::string type;   ///< "package/Type"
  bool latching = false;
  bool was_tf_message = false;  ///< true: its type is gone: `type` has the same fields and MD5
};

std::string textOf(const bson_t& document, const char* path) {
  return textAt(document, path).value_or("");
}

/// A date that can be a ROS time.
std::optional<Stamp> dateOf(const bson_t& document, const char* path) {
  constexpr std::int64_t kEnd_ms = std::int64_t{1000} << 32;
  const auto ms = dateAt(document, path);
  if (!ms || *ms < 0 || *ms >= kEnd_ms) return std::nullopt;
  return Stamp{*ms * 1'000'000};
}

/// "geometry_msgs.msg._Twist.Twist" -> "geometry_msgs/Twist"
std::string typeOfClass(const std::string& python_class) {
  const std::size_t first = python_class.find('.');
  if (first == std::string::npos) return "";
  return python_class.substr(0, first) + "/" + python_class.substr(python_class.rfind('.') + 1);
}

std::string absolute(const std::string& topic) {
  return topic.empty() || topic.front() == '/' ? topic : "/" + topic;
}

RoslogFacts::Writer writerOf(const bson_t& document, const std::string& topic) {
  if (hasAt(document, "_meta.received_ns")) return RoslogFacts::Writer::Afterglow;
  if (hasAt(document, "_meta.inserted_by")) return RoslogFacts::Writer::MessageStore;
  return topic.empty() ? RoslogFacts::Writer::CppLogger : RoslogFacts::Writer::Logger;
}

std::optional<RoslogFacts> tfFacts(const bson_t& document) {
  const auto recorded = dateOf(document, "__recorded");
  if (!recorded || !hasAt(document, "transforms")) return std::nullopt;
  // tf/tfMessage is gone; this one has the same fields and MD5.
  return RoslogFacts{
      RoslogFacts::Writer::TfLogger, *recorded, absolute(textOf(document, "__topic")),
      "tf2_msgs/TFMessage",          false,     true};
}

/// Empty for a document that does not say what type of message it is or when it came.
std::optional<RoslogFacts> roslogFacts(const bson_t& document) {
  if (!hasAt(document, "_meta")) return tfFacts(document);
  RoslogFacts facts;
  facts.topic = absolute(textOf(document, "_meta.topic"));
  facts.writer = writerOf(document, facts.topic);
  facts.type = textOf(document, "_meta.stored_type");
  if (facts.type.empty()) facts.type = typeOfClass(textOf(document, "_meta.stored_class"));
  facts.was_tf_message = facts.type == "tf/tfMessage";
  if (facts.was_tf_message) facts.type = "tf2_msgs/TFMessage";
  const auto inserted = dateOf(document, "_meta.inserted_at");
  if (facts.type.empty() || !inserted) return std::nullopt;
  facts.inserted = *inserted;
  facts.latching = isTrueAt(document, "_meta.latch");
  return facts;
}

using Writer = RoslogFacts::Writer;

/// Remarks of many documents, each with how many there were.
class Remarks {
 public:
  void add(const std::string& before, const std::string& after) { ++counts_[{before, after}]; }
  std::vector<std::string> lines() const {
    std::vector<std::string> lines;
    for (const auto& [text, count] : counts_) {
      lines.push_back(text.first + ": " + counted(count, "message") + " " + text.second);
    }
    return lines;
  }

 private:
  std::map<std::pair<std::string, std::string>, std::uint64_t> counts_;
};

/// The definition of a type from a message that the store holds already.
std::optional<Definition> storedDefinition(const Store& store, const std::string& type) {
  for (const Behavior& behavior : store.behaviors({})) {
    for (const TopicSummary& topic : store.topics(behavior)) {
      if (topic.type != type) continue;
      const auto cursor = store.messages(behavior, {{topic.topic}});
      while (const auto message = cursor->next()) {
        const Channel channel = store.channel(message->channel);
        if (channel.type == type) return Definition{channel.definition, channel.md5};
      }
    }
  }
  return std::nullopt;
}

/// The topics of collections that do not say so themselves.
class TopicNames {
 public:
  TopicNames(const Store& store, const RoslogImport& import) {
    for (const Behavior& behavior : store.behaviors({})) add(behavior.topics);
    add(import.topics);
  }

  void add(const std::vector<std::string>& topics) {
    for (const std::string& topic : topics) by_collection_[collectionOf(topic)] = topic;
  }

  std::optional<std::string> find(const std::string& collection) const {
    const auto found = by_collection_.find(collection);
    if (found == by_collection_.end()) return std::nullopt;
    return found->second;
  }

 private:
  std::map<std::string, std::string> by_collection_;
};

struct RoslogChannel {
  Channel channel;
  std::optional<Schema> schema;  ///< empty: its messages are left out
  std::int64_t id = 0;           ///< id in the store
};

/// A document of a collection, in the order of its _id.
struct Entry {
  Stamp inserted;
  std::string id;
  const RoslogChannel* channel = nullptr;  ///< null: left out
  std::uint64_t sequence = 0;
};

/// Two passes: what there is, so that the order of all is known; then the messages, a collection at
/// a time. The server sorts by _id only, of which it always has an index.
class RoslogImporter {
 public:
  RoslogImporter(const std::string& uri, Store& store, const RoslogImport& import)
      : client_(uri), store_(store), import_(import), names_(store, import) {
    for (const std::string& collection : client_.collections(client_.database())) {
      if (collection.rfind("system.", 0) != 0) collections_[collection];
    }
    for (auto& [collection, entries] : collections_) list(collection, entries);
    order();
    if (ordered_.empty()) {
      const auto why = remarks_.lines();
      throw StoreError(client_.name() + ": there is nothing to import" +
                       (why.empty() ? "" : "; " + why.front()));
    }
  }

  RoslogImportResult run() {
    StoreImport import(store_, client_.name());
    recording_ = import.recording();
    for (auto& [key, channel] : channels_) {
      if (channel.schema) channel.id = store_.addChannel(recording_, channel.channel);
    }
    AppendBatch batch(store_, [&](std::uint64_t done) {
      if (import_.progress) import_.progress(done, ordered_.size());
    });
    for (const auto& [collection, entries] : collections_) read(collection, entries, batch);
    batch.flush();
    RoslogImportResult result;
    result.messages = batch.done();
    result.remarks = remarks_.lines();
    import.finish([&] { addBehaviors(result); });
    return result;
  }

 private:
  using ChannelKey = std::tuple<std::string, std::string, bool>;  // topic, type, latching

  // ------------------------------------------------------------------------------ what there is
  Bson filter() const {
    Bson range;
    if (import_.since) range.addDate("$gte", (import_.since->ns + 999'999) / 1'000'000);
    if (import_.until) range.addDate("$lt", (import_.until->ns + 999'999) / 1'000'000);
    if (range.empty()) return {};
    return Bson().add("$or", std::vector<Bson>{Bson().add("_meta.inserted_at", range),
                                               Bson().add("__recorded", range)});
  }

  Bson byId() const { return Bson().add("sort", Bson().add("_id", 1)); }

  void list(const std::string& collection, std::vector<Entry>& entries) {
    Bson projection;
    // "transforms" tells the tf logger's documents; a part of it is enough.
    for (const char* field :
         {"_meta.topic", "_meta.latch", "_meta.inserted_at", "_meta.inserted_by",
          "_meta.received_ns", "_meta.stored_class", "_meta.stored_type", "__recorded", "__topic",
          "transforms.child_frame_id"}) {
      projection.add(field, 1);
    }
    Bson options = byId();
    options.add("projection", projection);
    client_.find(client_.database(), collection, filter(), options, [&](const bson_t& document) {
      entries.push_back({{}, idOf(document), nullptr, 0});
      const auto facts = roslogFacts(document);
      if (!facts) {
        remarks_.add("collection " + collection, "left out: without a type or a time");
      } else if (facts->writer == Writer::Afterglow) {
        remarks_.add("collection " + collection,
                     "left out: Afterglow's own; --store reads them, 'afterglow sync' copies them");
      } else {
        entries.back().inserted = facts->inserted;
        entries.back().channel = channelOf(collection, *facts);
        if (facts->was_tf_message && entries.back().channel) {
          remarks_.add(entries.back().channel->channel.topic,
                       "of tf/tfMessage, now tf2_msgs/TFMessage, which has the same fields and MD5");
        }
      }
      return true;
    });
  }

  /// Orders as the server does, for the ObjectIds that all writers use.
  static std::string idOf(const bson_t& document) {
    bson_iter_t at;
    if (!bson_iter_init_find(&at, &document, "_id")) return "";
    if (!BSON_ITER_HOLDS_OID(&at)) {
      Bson id;
      bson_append_iter(&id.raw(), "", 0, &at);
      return {reinterpret_cast<const char*>(bson_get_data(&id.raw())), id.size()};
    }
    const bson_oid_t* oid = bson_iter_oid(&at);
    return {reinterpret_cast<const char*>(oid->bytes), sizeof oid->bytes};
  }

  const RoslogChannel* channelOf(const std::string& collection, const RoslogFacts& facts) {
    const std::string topic = topicOf(collection, facts);
    const bool is_wanted =
        import_.topics.empty() ||
        std::find(import_.topics.begin(), import_.topics.end(), topic) != import_.topics.end();
    if (!is_wanted) return nullptr;
    const auto [at, is_new] = channels_.try_emplace({topic, facts.type, facts.latching});
    RoslogChannel& channel = at->second;
    if (is_new) {
      channel.channel = {topic, facts.type, "", "", facts.latching, ""};
      define(channel);
    }
    if (channel.schema) return &channel;
    remarks_.add(topic,
                 "left out: no definition of " + facts.type + " on this machine or in the store");
    return nullptr;
  }

  std::string topicOf(const std::string& collection, const RoslogFacts& facts) {
    if (facts.writer == Writer::MessageStore) {
      // One collection holds messages of many types, which no topic can.
      const std::string topic = "/" + collection + "/" + facts.type;
      remarks_.add(topic, "of a message_store, which has no topics");
      return topic;
    }
    if (!facts.topic.empty()) return facts.topic;
    const auto known = names_.find(collection);
    const std::string topic = known.value_or("/" + collection);
    remarks_.add(topic, "of collection " + collection + ", which does not name its topic" +
                            (known || collection.find('_') == std::string::npos
                                 ? ""
                                 : "; each '_' may have been a '/' (--topic tells)"));
    return topic;
  }

  void define(RoslogChannel& channel) const {
    try {
      auto found = import_.definition(channel.channel.type);
      if (!found) found = storedDefinition(store_, channel.channel.type);
      if (!found) return;
      channel.schema = Schema::parse(channel.channel.type, found->text);
      channel.channel.definition = found->text;
      channel.channel.md5 = found->md5;
    } catch (const MessageError& problem) {
      throw StoreError(client_.name() + ": " + channel.channel.topic + ": " + problem.what());
    }
  }

  void order() {
    for (auto& [collection, entries] : collections_) {
      for (Entry& entry : entries) {
        if (entry.channel) ordered_.push_back(&entry);
      }
    }
    std::stable_sort(ordered_.begin(), ordered_.end(), [](const Entry* a, const Entry* b) {
      return std::tie(a->inserted.ns, a->id) < std::tie(b->inserted.ns, b->id);
    });
    for (std::size_t i = 0; i < ordered_.size(); ++i) ordered_[i]->sequence = i;
  }

  // ------------------------------------------------------------------------------- the messages
  void read(const std::string& collection, const std::vector<Entry>& entries, AppendBatch& batch) {
    auto entry = entries.begin();
    client_.find(client_.database(), collection, filter(), byId(), [&](const bson_t& document) {
      const std::string id = idOf(document);
      if (entry == entries.end()) return false;  // inserted since
      if (entry->id != id) {
        throw StoreError(client_.name() + ": collection " + collection +
                         " was changed while it was read");
      }
      if (entry->channel) add(*entry, document, batch);
      ++entry;
      return true;
    });
  }

  void add(const Entry& entry, const bson_t& document, AppendBatch& batch) {
    const RoslogChannel& channel = *entry.channel;
    Message message{channel.id, entry.inserted, entry.sequence, {}, {}};
    try {
      const BsonMessage read = messageFromBson(*channel.schema, document);
      message.bytes = encode(*channel.schema, read.document);
      for (const std::string& field : read.missing) {
        remarks_.add(channel.channel.topic, "without " + field + ", which is now zero");
      }
    } catch (const MessageError& problem) {
      return remarks_.add(channel.channel.topic, std::string("left out: ") + problem.what());
    }
    message.header_stamp = headerStamp(*channel.schema, message.bytes);
    batch.add(std::move(message));
  }

  // ------------------------------------------------------------------------------- the behaviors
  void addBehaviors(RoslogImportResult& result) {
    auto first = ordered_.begin();
    for (auto next = first + 1; first != ordered_.end(); ++next) {
      const bool is_gap =
          next == ordered_.end() ||
          (import_.split_gap_ns &&
           (*next)->inserted.ns - (*(next - 1))->inserted.ns > *import_.split_gap_ns);
      if (!is_gap) continue;
      result.behaviors.push_back(behaviorOf(first, next, result.remarks));
      first = next;
    }
  }

  Behavior behaviorOf(std::vector<Entry*>::const_iterator first,
                      std::vector<Entry*>::const_iterator end,
                      const std::vector<std::string>& remarks) {
    std::set<std::string> topics;
    for (auto entry = first; entry != end; ++entry) {
      topics.insert((*entry)->channel->channel.topic);
    }
    Behavior behavior;
    behavior.recording = recording_;
    behavior.name = import_.name.empty() ? client_.database() : import_.name;
    behavior.outcome = "imported";
    behavior.begin = (*first)->inserted;
    behavior.end = Stamp{(*(end - 1))->inserted.ns + 1};
    behavior.tags = import_.tags;
    behavior.topics.assign(topics.begin(), topics.end());
    behavior.remarks = remarks;
    behavior.remarks.push_back("stamps are those of mongodb_log, of whole milliseconds");
    behavior.id = store_.addBehavior(behavior);
    return behavior;
  }

  MongoClient client_;
  Store& store_;
  const RoslogImport& import_;
  TopicNames names_;
  Remarks remarks_;
  std::map<ChannelKey, RoslogChannel> channels_;
  std::map<std::string, std::vector<Entry>> collections_;
  std::vector<Entry*> ordered_;  ///< entries that are imported, by time
  std::int64_t recording_ = 0;
};

}  // namespace

RoslogImportResult importRoslog(const std::string& uri, Store& store, const RoslogImport& import) {
  RoslogImport complete = import;
  if (!complete.definition) {
    complete.definition = [installed = installedDefinitions()](const std::string& type) {
      return installed.find(type);
    };
  }
  return RoslogImporter(uri, store, complete).run();
}

}  // namespace afterglow::replay

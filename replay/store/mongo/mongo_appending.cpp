// How a MongoStore appends messages: in batches a collection, taken back when one fails.
#include <limits>

#include "replay/store/mongo/mongo_store.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kBatchMessages = 1000;
constexpr std::size_t kBatchBytes = 32 << 20;

}  // namespace

void MongoStore::prepareCollection(const std::string& collection) {
  if (prepared_.count(collection) > 0) return;
  client_.makeIndex(messages_, collection,
                    {"_meta.recording", "_meta.received_ns", "_meta.sequence"});
  prepared_.insert(collection);
}

void MongoStore::append(const std::vector<Message>& messages, Duplicates duplicates) {
  const std::lock_guard<std::recursive_mutex> lock(write_mutex_);
  requireWritable();
  prolongImports(messages);
  std::map<std::string, std::vector<const Message*>> by_collection;
  for (const Message& message : messages) {
    if (message.sequence > std::numeric_limits<std::int64_t>::max()) {
      client_.fail("append", "a sequence of " + std::to_string(message.sequence) + " is too large");
    }
    by_collection[channelInfo(message.channel)->collection].push_back(&message);
  }
  std::vector<Added> added;
  try {
    for (const auto& [collection, part] : by_collection) {
      appendTo(collection, part, duplicates, added);
    }
  } catch (...) {
    takeBack(added);
    throw;
  }
  onFailure([this, added] { takeBack(added); });
}

void MongoStore::appendTo(const std::string& collection,
                          const std::vector<const Message*>& messages, Duplicates duplicates,
                          std::vector<Added>& added) {
  prepareCollection(collection);
  for (std::size_t begin = 0, end = 0; begin < messages.size(); begin = end) {
    std::vector<Bson> documents;
    std::size_t bytes = 0;
    for (; end < messages.size() && end - begin < kBatchMessages && bytes < kBatchBytes; ++end) {
      const MongoChannel& channel = *channelInfo(messages[end]->channel);
      MongoDocument made = toMongo(*messages[end], channel, MongoFields::All, takes_non_finite_);
      if (!made.file.empty() && !blobs_.contains(made.file)) {
        added.push_back({collection, channel.recording.key, {}, {made.file}});
        blobs_.put(made.file, messages[end]->bytes);
      }
      bytes += made.bson.size();
      documents.push_back(std::move(made.bson));
    }
    const MongoWrite write = client_.insert(messages_, collection, documents);
    for (std::size_t i = begin; i < end; ++i) {
      if (write.duplicates.count(i - begin) > 0) continue;
      const MongoChannel& channel = *channelInfo(messages[i]->channel);
      if (added.empty() || added.back().collection != collection ||
          added.back().recording != channel.recording.key) {
        added.push_back({collection, channel.recording.key, {}, {}});
      }
      if (write.refused.count(i - begin) > 0) {
        insertAnyway(*messages[i], channel, duplicates, added.back());
      } else {
        added.back().sequences.push_back(static_cast<std::int64_t>(messages[i]->sequence));
      }
    }
    if (!write.duplicates.empty() && duplicates == Duplicates::Refuse) {
      refuse(*messages[begin + *write.duplicates.begin()]);
    }
  }
}

void MongoStore::refuse(const Message& message) const {
  throw StoreError(client_.name() + ": message " + std::to_string(message.sequence) +
                   " of the recording is there already");
}

/// A message some of whose fields the server does not take: with as many as it does.
void MongoStore::insertAnyway(const Message& message, const MongoChannel& channel,
                              Duplicates duplicates, Added& added) {
  std::string why;
  for (const MongoFields fields : {MongoFields::All, MongoFields::None}) {
    const MongoDocument made = toMongo(message, channel, fields, takes_non_finite_);
    const MongoWrite write = client_.insert(messages_, channel.collection, {made.bson});
    if (!write.duplicates.empty()) {
      if (duplicates == Duplicates::Skip) return;
      refuse(message);
    }
    if (write.refused.empty()) {
      added.sequences.push_back(static_cast<std::int64_t>(message.sequence));
      return;
    }
    why = write.why;
  }
  client_.fail("append to " + channel.collection, why);
}

void MongoStore::takeBack(const std::vector<Added>& added) const noexcept {
  try {
    for (const Added& part : added) {
      if (!part.sequences.empty()) {
        client_.remove(messages_, part.collection,
                       Bson()
                           .add("_meta.recording", part.recording)
                           .add("_meta.sequence", Bson().add("$in", part.sequences)));
      }
      for (const std::string& file : part.files) blobs_.remove(file);
    }
  } catch (const StoreError&) {  // the caller learns what went wrong first
  }
}

}  // namespace afterglow::replay

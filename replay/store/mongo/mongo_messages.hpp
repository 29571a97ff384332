/// \file
/// The messages of a MongoDB store (mongo_layout.hpp). Internal to replay/store.
///
/// Bytes that are too large for a document, in chunks: GridFS (github.com/mongodb/specifications,
/// gridfs-spec), bucket "fs". Every tool that knows GridFS reads it.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "replay/query/filter.hpp"
#include "replay/store/mongo/mongo_catalog.hpp"
#include "replay/store/mongo/mongo_client.hpp"
#include "replay/store/mongo/mongo_layout.hpp"

namespace afterglow::replay {

/// Files of a GridFS bucket under ids of their own, so that storing one again changes nothing.
/// The client must outlive it. Throws StoreError.
class MongoBlobs {
 public:
  MongoBlobs(const MongoClient& client, std::string database)
      : client_(client), database_(std::move(database)) {}

  void makeIndexes() const;
  /// The file itself comes last: one that was broken off is not there.
  void put(const std::string& id, const Bytes& contents) const;
  /// Empty if there is no such file; throws if length or checksum differ from those of put().
  std::optional<Bytes> get(const std::string& id) const;
  bool contains(const std::string& id) const;
  void remove(const std::string& id) const;

 private:
  const MongoClient& client_;
  std::string database_;
};

/// Returns a query for messages of a recording: those in [begin, end) on these channels of one
/// collection; all on the collection if `channels` is empty.
Bson messageQuery(const std::string& recording_key, Stamp begin, Stamp end,
                  const std::vector<std::int64_t>& channels);

/// A collection a topic, in the client's database. Throws StoreError. Reading: any thread; writing:
/// one thread at a time. Everything it is made of must outlive it.
class MongoMessages {
 public:
  MongoMessages(const MongoClient& client, const MongoCatalog& catalog, const MongoBlobs& blobs,
                UndoLog& undo);

  const MongoCatalog& catalog() const { return catalog_; }
  /// Throws StoreError for a name that this server cannot have.
  void requireNameable(const std::string& topic) const;
  /// All or none, unless the connection breaks or Duplicates::Skip is said: who sends again wants
  /// to find what is there. In batches a collection.
  void append(const std::vector<Message>& messages, Duplicates duplicates);
  /// Removes the messages in the behavior's interval, except those in the kept behaviors' ones.
  void remove(const Behavior& behavior, const std::vector<Behavior>& kept) const;

  /// Calls take(const bson_t&) with the documents found, which have nothing but _meta, until it
  /// returns false; `options` are those of the find command.
  template <typename Take>
  void find(const std::string& collection, const Bson& query, Bson options,
            const Take& take) const {
    options.add("projection", Bson().add("_meta", 1));
    client_.find(client_.database(), collection, query, options, take);
  }
  Message read(const bson_t& document) const;
  /// False too if its bytes do not fit their definition.
  bool matches(const Message& message, const Condition& condition) const;
  std::optional<Stamp> lastStamp(std::int64_t recording) const;
  /// Returns summaries by topic and type: those of a behavior's own topics, or of its recording's
  /// other topics.
  std::vector<TopicSummary> summaries(const Behavior& behavior, bool own) const;

 private:
  /// Messages of one collection that were added together.
  struct Added {
    std::string collection, recording;
    std::vector<std::int64_t> sequences;
    std::vector<std::string> files;
  };

  void prepareCollection(const std::string& collection);
  void appendTo(const std::string& collection, const std::vector<const Message*>& messages,
                Duplicates duplicates, std::vector<Added>& added);
  void insertAnyway(const Message& message, const MongoChannel& channel, Duplicates duplicates,
                    Added& added);
  [[noreturn]] void refuse(const Message& message) const;
  void takeBack(const std::vector<Added>& added) const noexcept;

  const MongoClient& client_;
  const MongoCatalog& catalog_;
  const MongoBlobs& blobs_;
  UndoLog& undo_;
  const bool takes_non_finite_;     ///< the server, of numbers
  std::set<std::string> prepared_;  ///< collections that have their index
};

}  // namespace afterglow::replay

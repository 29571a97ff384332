/// \file
/// The store on a MongoDB server. Its format: replay/store/mongo/mongo_layout.hpp. Needs
/// libmongoc; for .cpp files and internal headers of replay/store.
#pragma once

#include <mutex>
#include <string>

#include "replay/store/mongo/mongo_catalog.hpp"
#include "replay/store/mongo/mongo_client.hpp"
#include "replay/store/mongo/mongo_messages.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Writes go to the server at once, acknowledged as the URI says (mongo_client.hpp). Any number of
/// stores, in any number of processes, may write at a time. A single server has no transactions:
/// - transaction() takes back its writes when its work throws, unless the connection is broken.
///   Others see the writes meanwhile. Messages that removeBehavior drops go
///   when the work has returned.
/// - append() takes back likewise. After a broken connection part of the messages may be there:
///   append them again with Duplicates::Skip.
/// Its parts: recordings, channels and imports (MongoCatalog), messages (MongoMessages,
/// MongoCursor), searches (MongoQuery), transactions (UndoLog); behaviors are its own.
/// OpenMode::Record takes no lock and marks nothing, for a fleet has many recorders; it waits for
/// an answer for 10 s, not a minute: so a recorder sends (RecorderStore).
class MongoStore final : public Store {
 public:
  MongoStore(const std::string& uri, OpenMode mode);

  std::int64_t addRecording(const Recording& recording) override;
  std::int64_t beginImport(const Recording& recording) override;
  void finishImport(std::int64_t recording) override;
  void dropRecording(std::int64_t recording) override;
  std::size_t dropUnfinished() override;
  std::int64_t addChannel(std::int64_t recording, const Channel& channel) override;
  void append(const std::vector<Message>& messages,
              Duplicates duplicates = Duplicates::Refuse) override;
  std::int64_t addBehavior(const Behavior& behavior) override;
  void updateBehavior(const Behavior& behavior) override;
  void removeBehavior(std::int64_t id) override;
  void addFile(const std::string& sha256, const Bytes& contents) override;
  void transaction(const std::function<void()>& work) override;

  std::vector<Recording> recordings() const override;
  std::vector<Behavior> behaviors(const BehaviorFilter& filter) const override;
  std::vector<std::string> explain(const BehaviorFilter& filter) const override;
  std::optional<Behavior> behavior(std::int64_t id) const override;
  std::optional<Behavior> behaviorOfKey(const std::string& key) const override;
  std::vector<TopicSummary> topics(const Behavior& behavior) const override;
  std::vector<TopicSummary> contextTopics(const Behavior& behavior) const override;
  Channel channel(std::int64_t id) const override;
  std::unique_ptr<MessageCursor> messages(const Behavior& behavior,
                                          const MessageRange& range) const override;
  std::optional<Bytes> file(const std::string& sha256) const override;

 private:
  using Lock = std::unique_lock<std::recursive_mutex>;

  void prepare(OpenMode mode);
  /// Throws if the store was opened for reading.
  Lock lockToWrite();
  std::optional<Behavior> findBehavior(const Bson& query) const;
  Behavior requireBehavior(std::int64_t id) const;
  /// Removes the messages of a behavior that is not there any more, but for those of others.
  void removeUncovered(const Behavior& removed) const;

  const MongoClient client_;
  const std::string rest_;  ///< the database of everything but the messages
  const bool is_read_only_;
  UndoLog undo_;
  MongoCatalog catalog_;
  MongoBlobs blobs_;
  MongoMessages messages_;
  std::recursive_mutex write_mutex_;  ///< recursive: a transaction's work calls other methods
};

}  // namespace afterglow::replay

/// \file
/// The store on a MongoDB server. What is on it: replay/store/mongo/mongo_layout.hpp. Needs
/// libmongoc; for .cpp files and internal headers of replay/store.
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <set>

#include "replay/query/filter.hpp"
#include "replay/store/mongo/mongo_blobs.hpp"
#include "replay/store/mongo/mongo_client.hpp"
#include "replay/store/mongo/mongo_layout.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Writes go to the server at once, acknowledged as the URI says (mongo_client.hpp). Any number of
/// stores, in any number of processes, may write at a time. A single server has no transactions:
/// - transaction() takes back what its work had added when the work throws; if the connection is
///   what broke, it cannot. Others see the parts meanwhile. Messages that removeBehavior drops go
///   when the work has returned.
/// - append() takes back likewise. After a broken connection part of the messages may be there:
///   append them again with Duplicates::Skip.
/// OpenMode::Record takes no lock and marks nothing, for a fleet has many recorders; it waits for
/// an answer for 10 s, not a minute. A recorder writes through a SpooledStore (spooled_store.hpp).
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

  /// The first of `count` behavior ids that are the caller's to use from now on.
  std::int64_t reserveBehaviorIds(std::int64_t count);

 private:
  friend class MongoCursor;
  using ChannelPtr = std::shared_ptr<const MongoChannel>;
  /// What a query looked at.
  struct Effort {
    std::size_t behaviors = 0, messages = 0;
    std::set<std::string> asked;  ///< of the server, about messages
  };
  /// Messages of one collection that were added together.
  struct Added {
    std::string collection, recording;
    std::vector<std::int64_t> sequences;
    std::vector<std::string> files;
  };

  void prepare(OpenMode mode);
  void prepareCollection(const std::string& collection);
  void requireWritable() const;
  Recording recording(std::int64_t id) const;
  ChannelPtr channelInfo(std::int64_t id) const;
  ChannelPtr readChannel(const bson_t& document) const;
  std::vector<ChannelPtr> channelsOf(std::int64_t recording) const;
  std::string definitionId(const Channel& channel);
  void appendTo(const std::string& collection, const std::vector<const Message*>& messages,
                Duplicates duplicates, std::vector<Added>& added);
  void insertAnyway(const Message& message, const MongoChannel& channel, Duplicates duplicates,
                    Added& added);
  [[noreturn]] void refuse(const Message& message) const;
  void checkObjects(const Behavior& behavior) const;
  void takeBack(const std::vector<Added>& added) const noexcept;
  void removeUncovered(const Behavior& removed) const;
  void prolongImports(const std::vector<Message>& messages);
  void onFailure(std::function<void()> undo);

  Bson behaviorQuery(const BehaviorFilter& filter) const;
  std::vector<Behavior> select(const BehaviorFilter& filter, Effort& effort) const;
  bool isWanted(const Behavior& behavior, const BehaviorFilter& filter, Effort& effort) const;
  bool hasMessage(const Behavior& behavior, const std::string& topic, const Condition* condition,
                  Effort& effort) const;
  bool isMatch(const Message& message, const Condition& condition) const;
  Message readMessage(const bson_t& document) const;
  std::optional<Stamp> lastStamp(std::int64_t recording) const;
  std::vector<TopicSummary> summaries(const Behavior& behavior, bool own) const;

  MongoClient client_;
  const std::string messages_;  ///< the database of the messages
  const std::string rest_;      ///< the database of everything else
  MongoBlobs blobs_;
  const bool is_read_only_;
  bool takes_non_finite_ = true;

  mutable std::mutex cache_mutex_;
  mutable std::map<std::int64_t, Recording> known_recordings_;
  mutable std::map<std::int64_t, ChannelPtr> known_channels_;
  /// This object's imports, and when the server was last told that they live.
  std::map<std::int64_t, std::chrono::steady_clock::time_point> imports_;
  std::set<std::string> prepared_;  ///< collections that have their index

  std::recursive_mutex write_mutex_;  ///< recursive: a transaction's work calls other methods
  bool is_in_transaction_ = false;
  std::vector<std::function<void()>> on_failure_, on_success_;
};

/// Which messages of a recording: those in [begin, end) on these channels of one collection; all on
/// the collection if `channels` is empty.
Bson messageQuery(const std::string& recording_key, Stamp begin, Stamp end,
                  const std::vector<std::int64_t>& channels);

/// What the server can be asked on behalf of a condition: it holds for every message for which the
/// condition does, and for others. Empty: nothing.
std::optional<Bson> narrowing(const Condition& condition, const Schema& schema);

}  // namespace afterglow::replay

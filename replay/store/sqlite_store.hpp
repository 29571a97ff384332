/// \file
/// The store in one SQLite file. What is in the file: replay/store/sqlite_schema.hpp.
#pragma once

#include <map>
#include <mutex>

#include "replay/messages/schema.hpp"
#include "replay/store/sqlite.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct SqliteLimits {
  /// Larger messages are refused: SQLite's largest row has 10^9 bytes, with the document in it.
  std::size_t largest_message = 990'000'000;
  /// Number arrays longer than this are named in a document by type and count only: writing numbers
  /// out takes ten times as long as storing them.
  std::size_t longest_array = 64;
  /// Longer documents are left out.
  std::size_t longest_document = 1 << 20;
};

/// One connection behind one lock. Several stores, in this process or others, may be open on one
/// file: one writes at a time, readers never wait for it. What append() returned from is on disk.
class SqliteStore final : public Store {
 public:
  SqliteStore(const std::string& path, OpenMode mode, const SqliteLimits& limits = {});

  std::int64_t addRecording(const Recording& recording) override;
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
  /// What appending to a channel needs to know of it.
  struct ChannelInfo {
    std::int64_t recording = 0;
    std::shared_ptr<const Schema> schema;  ///< null: the definition cannot be understood
  };
  using Lock = std::unique_lock<std::recursive_mutex>;

  [[noreturn]] void fail(const std::string& text) const;
  void requireRecording(std::int64_t id);
  std::int64_t definitionId(const Channel& channel);
  ChannelInfo channelInfo(std::int64_t channel);
  std::vector<ChannelInfo> channelInfos(const std::vector<Message>& messages);
  void insert(SqliteStatement& statement, const Message& message, const ChannelInfo& info,
              const std::optional<std::string>& document);
  void checkObjects(const Behavior& behavior) const;
  std::vector<TopicSummary> summaries(const Behavior& behavior, bool own) const;

  const SqliteLimits limits_;
  mutable std::recursive_mutex mutex_;  ///< recursive: a transaction's work calls other methods
  std::unique_ptr<SqliteConnection> connection_;
  std::unique_ptr<SqliteStatement> insert_message_, insert_new_message_;
  std::map<std::int64_t, ChannelInfo> channel_infos_;  ///< of channels appended to
};

}  // namespace afterglow::replay

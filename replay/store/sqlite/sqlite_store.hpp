/// \file
/// The store in one SQLite file. What is in the file: replay/store/sqlite/sqlite_schema.hpp.
#pragma once

#include <map>
#include <mutex>

#include "replay/store/sqlite/import_lock.hpp"
#include "replay/store/sqlite/recorder_lock.hpp"
#include "replay/store/sqlite/sqlite.hpp"
#include "replay/store/sqlite/sqlite_field_index.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct SqliteLimits {
  /// Larger messages are refused; it is ROS's own limit.
  std::size_t largest_message = 1'000'000'000;
  /// Pages of the log of commits at which it is folded into the database (32 MiB), and at which
  /// readers are waited for (256 MiB).
  int fold_log_pages = 2048;
  int longest_log_pages = 8 * 2048;
};

/// One connection behind one lock. Several stores, in this process or others, may be open on one
/// file: one writes at a time, readers never wait for it. What append() returned from is on disk.
/// A behavior without an end in a store that is opened ReadOnly, and that nobody records into, is
/// given out as kIncomplete: its recorder died.
class SqliteStore final : public Store {
 public:
  SqliteStore(const std::string& path, OpenMode mode, const SqliteLimits& limits = {});
  SqliteStore(const SqliteStore&) = delete;
  SqliteStore& operator=(const SqliteStore&) = delete;
  ~SqliteStore() override;

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
  void compact() override;

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
  std::optional<std::uint64_t> usedBytes() const override;

 private:
  using Lock = std::unique_lock<std::recursive_mutex>;
  struct Interval {
    std::int64_t begin_ns, end_ns;
  };

  [[noreturn]] void fail(const std::string& text) const;
  void requireRecording(std::int64_t id);
  bool hasBehaviors(std::int64_t recording);
  bool isUnfinished(std::int64_t recording);
  std::int64_t definitionId(const Channel& channel);
  std::int64_t recordingOf(std::int64_t channel);
  void checkMessages(const std::vector<Message>& messages) const;
  bool insert(SqliteStatement& statement, const Message& message);
  void insertChunks(std::int64_t message, const Bytes& bytes);
  void checkObjects(const Behavior& behavior) const;
  std::vector<Interval> coveredOnlyBy(const Behavior& behavior) const;
  std::int64_t sliceEnd(std::int64_t recording, Interval interval) const;
  void removeMessages(const Behavior& behavior, Interval interval);
  void endAbandonedBehaviors();
  bool areOpenOnesAbandoned() const;
  std::optional<Behavior> behaviorOf(SqliteStatement& query) const;
  std::string candidatesSql(const BehaviorFilter& filter) const;
  std::vector<Behavior> candidates(const BehaviorFilter& filter) const;
  std::vector<Behavior> find(const BehaviorFilter& filter, std::vector<std::string>* steps) const;
  std::string accessOf(const BehaviorFilter& filter) const;
  std::vector<TopicSummary> summaries(const Behavior& behavior, bool own) const;
  SqliteStatement& countsOf(const Behavior& behavior) const;

  const std::string path_;
  const OpenMode mode_;
  const SqliteLimits limits_;
  std::optional<RecorderLock> recorder_lock_;
  mutable std::recursive_mutex mutex_;  ///< recursive: a transaction's work calls other methods
  std::unique_ptr<SqliteConnection> connection_;
  std::unique_ptr<SqliteFieldIndex> field_index_;
  std::map<std::int64_t, std::int64_t> recordings_;  ///< of channels appended to
  std::map<std::int64_t, ImportLock> import_locks_;  ///< of this object's imports, by recording
};

}  // namespace afterglow::replay

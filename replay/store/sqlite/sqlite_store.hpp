/// \file
/// The store in one SQLite file, whose format replay/store/sqlite/sqlite_schema.hpp describes.
#pragma once

#include "replay/store/sqlite/sqlite_behaviors.hpp"
#include "replay/store/sqlite/sqlite_imports.hpp"

namespace afterglow::replay {

struct SqliteLimits {
  /// Larger messages are refused, as ROS does.
  std::size_t largest_message = 1'000'000'000;
  /// Length of the log of commits, in pages, from which on it is folded into the database (32 MiB),
  /// and from which on a commit waits for readers to do so (256 MiB).
  int fold_log_pages = 2048;
  int longest_log_pages = 8 * 2048;
};

/// A store on a SQLite file: one connection behind one lock, and an object for each part of the
/// store that shares them. Several stores, in this process or others, may be open on one file: one
/// writes at a time, readers never wait for it. A message is on disk when append() has returned. In
/// a store that is opened ReadOnly, and that nobody records into, a behavior without an end has the
/// outcome kIncomplete: its recorder died.
class SqliteStore final : public Store {
 public:
  SqliteStore(const std::string& path, OpenMode mode, const SqliteLimits& limits = {});
  SqliteStore(const SqliteStore&) = delete;
  SqliteStore& operator=(const SqliteStore&) = delete;

  std::int64_t addRecording(const Recording& recording) override {
    return recordings_.add(recording);
  }
  std::int64_t beginImport(const Recording& recording) override {
    return imports_.begin(recording);
  }
  void finishImport(std::int64_t recording) override { imports_.finish(recording); }
  void dropRecording(std::int64_t recording) override { imports_.dropRecording(recording); }
  std::size_t dropUnfinished() override { return imports_.dropUnfinished(); }
  std::int64_t addChannel(std::int64_t recording, const Channel& channel) override {
    return recordings_.addChannel(recording, channel);
  }
  void append(const std::vector<Message>& messages,
              Duplicates duplicates = Duplicates::Refuse) override {
    messages_.append(messages, duplicates);
  }
  std::int64_t addBehavior(const Behavior& behavior) override { return behaviors_.add(behavior); }
  void updateBehavior(const Behavior& behavior) override { behaviors_.update(behavior); }
  void removeBehavior(std::int64_t id) override { behaviors_.remove(id); }
  void addFile(const std::string& sha256, const Bytes& contents) override;
  void transaction(const std::function<void()>& work) override;
  void compact() override;

  std::vector<Recording> recordings() const override { return recordings_.all(); }
  std::vector<Behavior> behaviors(const BehaviorFilter& filter) const override {
    return behaviors_.find(filter);
  }
  std::vector<std::string> explain(const BehaviorFilter& filter) const override;
  std::optional<Behavior> behavior(std::int64_t id) const override { return behaviors_.ofId(id); }
  std::optional<Behavior> behaviorOfKey(const std::string& key) const override {
    return behaviors_.ofKey(key);
  }
  std::vector<TopicSummary> topics(const Behavior& behavior) const override;
  std::vector<TopicSummary> contextTopics(const Behavior& behavior) const override;
  Channel channel(std::int64_t id) const override { return recordings_.channel(id); }
  std::unique_ptr<MessageCursor> messages(const Behavior& behavior,
                                          const MessageRange& range) const override {
    return messages_.read(behavior, range);
  }
  std::optional<Bytes> file(const std::string& sha256) const override;
  std::optional<std::uint64_t> usedBytes() const override;
  std::string folder() const override;

 private:
  const std::string path_;  ///< empty: in memory
  const OpenMode mode_;
  std::optional<RecorderLock> recorder_lock_;
  std::unique_ptr<SqliteConnection> connection_;
  SqliteRecordings recordings_;
  SqliteMessages messages_;
  SqliteImports imports_;
  SqliteBehaviors behaviors_;
};

}  // namespace afterglow::replay

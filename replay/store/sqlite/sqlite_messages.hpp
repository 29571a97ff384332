/// \file
/// The message log of a SQLite store: messages go in, come out and are removed; its recordings and
/// the channels in them. Internal to replay/store.
#pragma once

#include <map>
#include <vector>

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// Throws StoreError. The connection must outlive it.
class SqliteRecordings {
 public:
  explicit SqliteRecordings(SqliteConnection& connection) : connection_(connection) {}

  /// Does what Store::addRecording() and so on do.
  std::int64_t add(const Recording& recording);
  std::vector<Recording> all() const;
  std::int64_t addChannel(std::int64_t recording, const Channel& channel);
  Channel channel(std::int64_t id) const;

  void require(std::int64_t recording) const;
  bool hasBehaviors(std::int64_t recording) const;
  std::int64_t ofChannel(std::int64_t channel);
  /// Removes the rows of a recording, its channels, and definitions that no channel uses any more.
  /// In the transaction that is open; the recording has no messages and behaviors.
  void remove(std::int64_t recording);
  /// Forgets ids that may be given out again: a transaction was undone, a recording removed.
  void forget() { of_channel_.clear(); }

 private:
  std::int64_t definitionId(const Channel& channel);

  SqliteConnection& connection_;
  std::map<std::int64_t, std::int64_t> of_channel_;  ///< recordings by channel
};

/// Throws StoreError; all must outlive it.
class SqliteMessages {
 public:
  /// Half open.
  struct Interval {
    std::int64_t begin_ns, end_ns;
  };

  /// Messages of more than `largest` bytes are refused.
  SqliteMessages(SqliteConnection& connection, SqliteRecordings& recordings, std::size_t largest);

  /// Does what Store::append() and Store::messages() do.
  void append(const std::vector<Message>& messages, Duplicates duplicates);
  std::unique_ptr<MessageCursor> read(const Behavior& behavior, const MessageRange& range) const;

  /// Removes messages in slices of a transaction each, so that a recorder need not wait for
  /// gigabytes to be removed. The counts of `behavior` are lowered; no other behavior covers the
  /// interval.
  void remove(std::int64_t recording, Interval interval, std::int64_t behavior = 0);

 private:
  void check(const std::vector<Message>& messages) const;
  bool insert(SqliteStatement& statement, std::int64_t recording, const Message& message);
  void insertChunks(std::int64_t message, const Bytes& bytes);
  std::int64_t sliceEnd(std::int64_t recording, Interval interval) const;
  void removeSlice(std::int64_t recording, Interval slice, std::int64_t behavior);

  SqliteConnection& connection_;
  SqliteRecordings& recordings_;
  const std::size_t largest_;
};

}  // namespace afterglow::replay

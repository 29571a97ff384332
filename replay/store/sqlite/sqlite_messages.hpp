/// \file
/// The message log of a SQLite store: messages go in, come out and are removed. Internal to
/// replay/store.
#pragma once

#include <vector>

#include "replay/store/sqlite/sqlite_recordings.hpp"

namespace afterglow::replay {

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

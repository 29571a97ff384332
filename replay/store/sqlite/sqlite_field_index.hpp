/// \file
/// Keeps a SQLite store's field index as messages come and go. Internal to replay/store.
///
/// Every message lies in the time of a row of field_blocks of its channel, from the transaction on
/// that stored it: a row is there, open (it answers nothing and reaches to the end of time), before
/// its block is full or cut. A writer that dies leaves it open.
#pragma once

#include <map>
#include <memory>

#include "replay/query/field_index.hpp"
#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// Used under the lock of its connection, which it does not outlive.
class SqliteFieldIndex {
 public:
  explicit SqliteFieldIndex(SqliteConnection& connection) : connection_(connection) {}

  /// In the transaction that stores the message.
  void add(std::int64_t recording, const Message& message);
  /// Ends the blocks of a recording, so that none straddles the begin or end of a behavior.
  void cut(std::int64_t recording);
  void cutAll();
  bool hasOpenBlocks() const;
  /// All messages of a recording in [begin, end) are removed, in this transaction.
  void remove(std::int64_t recording, std::int64_t begin_ns, std::int64_t end_ns);
  /// A transaction is undone: what it added is not there.
  void forget();
  /// A recording is gone, and its channels and definitions with it.
  void forget(std::int64_t recording);

  /// The fields of a channel's messages; null if its definition cannot be understood.
  std::shared_ptr<const FieldSlots> slotsOf(std::int64_t channel);

 private:
  struct OpenBlock {
    std::int64_t recording = 0;
    std::unique_ptr<FieldBlockWriter> writer;  ///< null: nothing to index
    std::int64_t id = 0, first_ns = 0, last_ns = 0;
  };
  void endAbandoned(std::int64_t recording, std::int64_t channel);
  void begin(std::int64_t channel, OpenBlock& block, std::int64_t received_ns);
  void moveBegin(std::int64_t channel, OpenBlock& block, std::int64_t received_ns);
  void end(std::int64_t channel, OpenBlock& block);
  OpenBlock& blockOf(std::int64_t recording, std::int64_t channel);

  SqliteConnection& connection_;
  std::map<std::int64_t, OpenBlock> blocks_;                         ///< by channel
  std::map<std::int64_t, std::shared_ptr<const FieldSlots>> slots_;  ///< by definition
};

}  // namespace afterglow::replay

/// \file
/// The field index of a SQLite store: its table of blocks (field_blocks.hpp), kept as messages come
/// and go, and read for queries. Internal to replay/store.
///
/// The time of every message lies in a row of field_blocks of its channel, from the transaction on
/// that stored the message: the row of a block that is not full yet is open, which means that it
/// answers nothing and reaches to the end of time. A writer that dies leaves it open.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "replay/store/sqlite/field_blocks.hpp"
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
  /// All messages of a recording are removed, and its channels and their definitions are about to.
  void removeAll(std::int64_t recording);
  /// A transaction was undone, and the blocks that it added with it.
  void forget();

  /// The fields of a channel's messages; null if its definition cannot be understood.
  std::shared_ptr<const FieldSlots> slotsOf(std::int64_t channel);

 private:
  struct OpenBlock {
    std::int64_t recording = 0;
    std::unique_ptr<FieldBlockWriter> writer;  ///< null: the channel has no index
    std::int64_t id = 0, first_ns = 0, last_ns = 0;
    bool isEmpty() const { return !writer || writer->messages() == 0; }
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

/// What the field index tells of one channel's messages and one condition.
class ChannelAnswers {
 public:
  /// A block's interval, both ends in it.
  struct Block {
    std::int64_t first_ns, last_ns;
    Answer answer;  ///< never Some or All if messages of the block were removed
  };

  /// Reads the blocks that reach into [begin, end); used under the lock of the connection. The
  /// condition must outlive it.
  ChannelAnswers(SqliteConnection& connection, SqliteFieldIndex& index, std::int64_t channel,
                 const Condition& condition, std::int64_t begin_ns, std::int64_t end_ns);

  /// Calls visit(block) for the blocks that reach into [begin, end).
  template <typename Visit>
  void forBlocks(std::int64_t begin_ns, std::int64_t end_ns, const Visit& visit) const {
    for (std::size_t i = firstBlock(begin_ns); i < blocks_.size(); ++i) {
      if (blocks_[i].first_ns >= end_ns) break;
      if (blocks_[i].last_ns >= begin_ns) visit(blocks_[i]);
    }
  }

  /// True if surely no message of this time matches.
  bool isRuledOut(Stamp received) const;
  /// Decodes the message. One that cannot be decoded matches only the empty condition.
  bool matches(const Message& message) const;

 private:
  std::size_t firstBlock(std::int64_t begin_ns) const;

  const Condition& condition_;
  std::shared_ptr<const FieldSlots> slots_;
  std::vector<Block> blocks_;         ///< by first_ns
  std::vector<std::int64_t> latest_;  ///< the latest last_ns up to each block
};

}  // namespace afterglow::replay

/// \file
/// What the field index of a SQLite store says of one channel's messages and one condition.
/// Internal to replay/store.
#pragma once

#include <memory>
#include <vector>

#include "replay/store/sqlite/sqlite_field_index.hpp"

namespace afterglow::replay {

class ChannelAnswers {
 public:
  /// A block's interval, both ends in it.
  struct Block {
    std::int64_t first_ns, last_ns;
    Answer answer;  ///< of a block that lost messages never Some or All
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

  /// True if no message of this time matches, without a look at it.
  bool isRuledOut(Stamp received) const;
  /// A look at the message itself. One that cannot be decoded matches only what asks for nothing.
  bool matches(const Message& message) const;

 private:
  std::size_t firstBlock(std::int64_t begin_ns) const;

  const Condition& condition_;
  std::shared_ptr<const FieldSlots> slots_;
  std::vector<Block> blocks_;         ///< by first_ns
  std::vector<std::int64_t> latest_;  ///< the latest last_ns up to each block
};

}  // namespace afterglow::replay

/// \file
/// Reads a behavior's messages from a SqliteStore. Internal to replay.
#pragma once

#include <deque>
#include <map>
#include <mutex>

#include "replay/store/sqlite/channel_answers.hpp"
#include "replay/store/sqlite/sqlite_message_reader.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Fetches a page at a time and remembers the key of the last message, not an open query: between
/// pages it holds no lock and no snapshot, so writers go on and the log's WAL can be folded in.
/// What is appended behind that key meanwhile is read too.
class SqliteCursor final : public MessageCursor {
 public:
  /// Connection, mutex and index must outlive it.
  SqliteCursor(SqliteConnection& connection, std::recursive_mutex& mutex, SqliteFieldIndex& index,
               const Behavior& behavior, const MessageRange& range);
  SqliteCursor(const SqliteCursor&) = delete;
  SqliteCursor& operator=(const SqliteCursor&) = delete;
  ~SqliteCursor() override;

  std::optional<Message> next() override;
  std::vector<DamagedMessage> damaged() const override { return damaged_; }

 private:
  void readPage();
  ChannelAnswers& answersOf(std::int64_t channel);

  SqliteConnection& connection_;
  std::recursive_mutex& mutex_;
  SqliteFieldIndex& index_;
  std::shared_ptr<const Filter> where_;             ///< null: all
  std::map<std::int64_t, ChannelAnswers> answers_;  ///< by channel, with a filter
  /// The order comes from the index alone, so damage to a message's row costs that message only.
  std::unique_ptr<SqliteStatement> query_;
  std::unique_ptr<SqliteMessageReader> reader_;
  std::int64_t recording_;
  std::optional<std::string> topics_;  ///< JSON array; empty: all
  std::int64_t end_ns_;
  /// Key of the last message read.
  std::int64_t received_ns_, sequence_ = -1, channel_ = -1;
  std::deque<Message> page_;
  std::vector<DamagedMessage> damaged_;
};

}  // namespace afterglow::replay

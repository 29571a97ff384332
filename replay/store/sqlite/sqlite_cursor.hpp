/// \file
/// Reads messages of a SQLite store. Internal to replay/store.
#pragma once

#include <deque>
#include <map>

#include "replay/store/sqlite/sqlite_field_index.hpp"

namespace afterglow::replay {

/// Reads the bytes of one stored message and checks them. Used under the lock of its connection,
/// which it does not outlive.
class SqliteMessageReader {
 public:
  struct Contents {
    Bytes bytes;
    std::optional<Stamp> header_stamp;
    std::string problem;  ///< why the bytes are not those that were stored; empty: they are
  };

  explicit SqliteMessageReader(SqliteConnection& connection);
  Contents read(std::int64_t message);

 private:
  void readRow(std::int64_t message, Contents& contents);
  void readChunks(std::int64_t message, Contents& contents);

  SqliteStatement row_, chunks_;
  std::size_t size_ = 0;
  std::int64_t checksum_ = 0;
  bool is_chunked_ = false;
};

/// Reads a behavior's messages. Fetches a page at a time and remembers the key of the last message,
/// not an open query: between pages it holds no lock and no snapshot, so writers go on and the log
/// of commits can be folded into the database. Messages that are appended behind that key meanwhile
/// are read, too.
class SqliteCursor final : public MessageCursor {
 public:
  /// Connection and index must outlive it.
  SqliteCursor(SqliteConnection& connection, SqliteFieldIndex& index, const Behavior& behavior,
               const MessageRange& range);
  SqliteCursor(const SqliteCursor&) = delete;
  SqliteCursor& operator=(const SqliteCursor&) = delete;
  ~SqliteCursor() override;

  std::optional<Message> next() override;
  std::vector<DamagedMessage> damaged() const override { return damaged_; }

 private:
  void readPage();
  ChannelAnswers& answersOf(std::int64_t channel);

  SqliteConnection& connection_;
  SqliteFieldIndex& index_;
  std::shared_ptr<const Filter> where_;             ///< null: all
  std::map<std::int64_t, ChannelAnswers> answers_;  ///< by channel, with a filter
  /// Answered by the index of the table alone: damage to a message's row costs that message only.
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

/// \file
/// Reads messages of a SQLite store. Internal to replay/store.
#pragma once

#include <deque>
#include <map>

#include "replay/query/filter.hpp"
#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// Reads the bytes of one stored message and checks them. Used under the lock of its connection,
/// which it does not outlive.
class SqliteMessageReader {
 public:
  struct Contents {
    Bytes bytes;
    std::optional<Stamp> header_stamp;
    std::string problem;  ///< reason if the bytes are not those stored
  };

  /// The columns that read() wants of a row of messages.
  static constexpr const char* kColumns = "id, header_stamp_ns, size, checksum, bytes";

  explicit SqliteMessageReader(SqliteConnection& connection);
  /// The message that a statement is at, whose columns from `column` on are kColumns. Throws
  /// SqliteDamage where the row is damaged.
  Contents read(const SqliteStatement& row, int column);
  /// Damage is a problem of the message, too.
  Contents read(std::int64_t message);

 private:
  void readChunks(std::int64_t message, Contents& contents);

  SqliteStatement row_, chunks_;
};

/// Reads a behavior's messages. Fetches a page at a time and remembers the key of the last message,
/// not an open query: between pages it holds no lock and no snapshot, so writers go on and the log
/// of commits can be folded into the database. Messages that are appended behind that key meanwhile
/// are read, too.
class SqliteCursor final : public MessageCursor {
 public:
  static constexpr std::size_t kPage = 2048;  ///< messages

  /// The connection must outlive it. `range.where` is not looked at: `where` tells which messages,
  /// all if it is null, and is kept.
  SqliteCursor(SqliteConnection& connection, const Behavior& behavior, const MessageRange& range,
               std::shared_ptr<const Condition> where, std::size_t page = kPage);
  SqliteCursor(const SqliteCursor&) = delete;
  SqliteCursor& operator=(const SqliteCursor&) = delete;
  ~SqliteCursor() override;

  std::optional<Message> next() override;
  std::vector<DamagedMessage> damaged() const override { return damaged_; }
  /// Returns how many messages were read so far, whether or not they match.
  std::uint64_t looked() const { return looked_; }

 private:
  std::unique_ptr<SqliteStatement> select(const char* columns);
  void readPage();
  void readPage(SqliteStatement& query, bool has_rows);
  bool matches(const Message& message);

  SqliteConnection& connection_;
  std::shared_ptr<const Condition> where_;
  const std::size_t page_size_;
  std::map<std::int64_t, MessageMatcher> matchers_;  ///< matchers by channel, with a filter
  std::uint64_t looked_ = 0;
  std::unique_ptr<SqliteStatement> rows_;
  /// Answered by the index of the table alone, so that damage to a message's row costs that message
  /// only; made when there is some.
  std::unique_ptr<SqliteStatement> keys_;
  std::unique_ptr<SqliteMessageReader> reader_;
  std::int64_t recording_;
  std::optional<std::string> topics_;  ///< JSON array; empty: all
  std::int64_t end_ns_;
  struct Key {
    std::int64_t received_ns = 0, sequence = -1, channel = -1;
  };
  Key last_;  ///< key of the last message read
  std::deque<Message> page_;
  std::vector<DamagedMessage> damaged_;
};

}  // namespace afterglow::replay

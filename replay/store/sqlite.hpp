/// \file
/// SQLite in C++ terms: a connection, prepared statements, a transaction. Internal to replay.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "replay/messages/message.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace afterglow::replay {

enum class SqliteAccess { ReadOnly, ReadOnlyImmutable, ReadWriteCreate };

/// One connection, used by one thread at a time. Throws StoreError with the store's name in front.
class SqliteConnection {
 public:
  /// `path` ":memory:" makes a database of its own in memory.
  SqliteConnection(const std::string& path, SqliteAccess access);
  SqliteConnection(const SqliteConnection&) = delete;
  SqliteConnection& operator=(const SqliteConnection&) = delete;
  ~SqliteConnection();

  void execute(const std::string& sql);
  std::int64_t integer(const std::string& sql);  ///< the one number that `sql` yields
  std::int64_t lastInsertedId() const;
  bool isInTransaction() const;
  const std::string& name() const { return name_; }

  /// Throws what SQLite says about the last call; `doing` completes "cannot ...".
  [[noreturn]] void fail(const std::string& doing) const;

 private:
  friend class SqliteStatement;
  sqlite3* connection_ = nullptr;
  std::string name_;  ///< "sqlite:PATH", as errors say it
};

/// A prepared statement, to be kept and run often. Lives no longer than its connection.
class SqliteStatement {
 public:
  SqliteStatement(SqliteConnection& connection, std::string_view sql);
  SqliteStatement(const SqliteStatement&) = delete;
  SqliteStatement& operator=(const SqliteStatement&) = delete;
  ~SqliteStatement();

  /// Parameters count from 1. Texts and bytes are not copied: they must live until reset().
  SqliteStatement& bind(int parameter, std::int64_t value);
  SqliteStatement& bind(int parameter, std::string_view text);
  SqliteStatement& bind(int parameter, const Bytes& bytes);
  SqliteStatement& bindNull(int parameter);
  template <typename T>
  SqliteStatement& bind(int parameter, const std::optional<T>& value) {
    return value ? bind(parameter, *value) : bindNull(parameter);
  }

  bool step();  ///< true: there is a row
  void run();   ///< to the end, and reset
  void reset();

  /// Columns count from 0; of the current row.
  std::int64_t integer(int column) const;
  std::optional<std::int64_t> optionalInteger(int column) const;
  std::string text(int column) const;
  Bytes bytes(int column) const;
  std::size_t size(int column) const;  ///< of a text or blob, in bytes

 private:
  void check(int code);

  SqliteConnection& connection_;
  sqlite3_stmt* statement_ = nullptr;
};

/// Resets a statement when a reader is done with it, also by exception.
class StatementScope {
 public:
  explicit StatementScope(SqliteStatement& statement) : statement_(statement) {}
  StatementScope(const StatementScope&) = delete;
  StatementScope& operator=(const StatementScope&) = delete;
  ~StatementScope() { statement_.reset(); }

 private:
  SqliteStatement& statement_;
};

/// All that is written between construction and commit(), or nothing. Inside another transaction it
/// joins that one.
class SqliteTransaction {
 public:
  explicit SqliteTransaction(SqliteConnection& connection);
  SqliteTransaction(const SqliteTransaction&) = delete;
  SqliteTransaction& operator=(const SqliteTransaction&) = delete;
  ~SqliteTransaction();
  void commit();

 private:
  SqliteConnection& connection_;
  bool is_outermost_;
  bool is_open_ = true;
};

}  // namespace afterglow::replay

/// \file
/// SQLite in C++ terms: a connection, prepared statements, a transaction. Internal to replay.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "replay/store/store.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace afterglow::replay {

/// A page or row of the file is damaged.
class SqliteDamage : public StoreError {
 public:
  SqliteDamage(const std::string& text, std::string reason)
      : StoreError(text), reason_(std::move(reason)) {}
  const std::string& reason() const { return reason_; }

 private:
  std::string reason_;
};

/// A row breaks a rule of its table.
class SqliteConstraint : public StoreError {
 public:
  using StoreError::StoreError;
};

enum class SqliteAccess { ReadOnly, ReadOnlyImmutable, ReadWriteCreate };

class SqliteStatement;
using SqliteLock = std::unique_lock<std::recursive_mutex>;

/// A connection, used by one thread at a time: whoever shares it with other threads holds its
/// lock() meanwhile. Throws StoreError with the store's name in front. After an input/output error
/// in writing, it refuses to write until a new connection is made.
class SqliteConnection {
 public:
  /// `path` ":memory:": a database in memory, which nobody else sees.
  SqliteConnection(const std::string& path, SqliteAccess access);
  SqliteConnection(const SqliteConnection&) = delete;
  SqliteConnection& operator=(const SqliteConnection&) = delete;
  ~SqliteConnection();

  /// A thread may lock it again: the work of a transaction calls other methods of the store.
  SqliteLock lock() { return SqliteLock(mutex_); }

  void execute(const std::string& sql);
  std::int64_t integer(const std::string& sql);  ///< the one number that `sql` yields
  std::int64_t lastInsertedId() const;
  std::int64_t changedRows() const;  ///< rows of the last INSERT, UPDATE or DELETE
  bool isInTransaction() const;
  const std::string& name() const { return name_; }

  /// The statement of this text, reset; kept with the connection. One caller at a time uses it.
  SqliteStatement& prepared(std::string_view sql);

  /// Sets when a commit folds the log of commits (WAL) into the database: when it is longer than
  /// `fold` pages. Beyond `longest` pages it waits for readers, which keep the log from being begun
  /// anew.
  void foldLog(int fold, int longest);

  /// The file's first bytes, as they are; returns how many there are, `size` at most. By SQLite's
  /// own descriptor: if this process closed another one of the file, it would lose its locks on it
  /// ("How To Corrupt An SQLite Database File", 2.2).
  std::size_t readStart(unsigned char* bytes, std::size_t size);

  /// Throws SQLite's reason for the failure of the last call; `doing` completes "cannot ...".
  [[noreturn]] void fail(const std::string& doing);
  /// Throws StoreError with this text behind the store's name.
  [[noreturn]] void refuse(const std::string& text) const { throw StoreError(name_ + ": " + text); }

 private:
  friend class SqliteStatement;
  friend class SqliteTransaction;
  static int onBusy(void* self, int times);
  static int onCommit(void* self, sqlite3* connection, const char* database, int pages);
  void requireWritable() const;
  void noteFailure(int code);

  std::recursive_mutex mutex_;
  sqlite3* connection_ = nullptr;
  std::string name_;  ///< "sqlite:PATH", as errors say it
  std::map<std::string, std::unique_ptr<SqliteStatement>, std::less<>> prepared_;
  std::chrono::milliseconds busy_timeout_{0};
  std::chrono::steady_clock::time_point busy_since_;
  int fold_pages_ = 0, longest_log_ = 0, next_wait_ = 0;
  /// The error with which the disk lost a write; empty: none. After it nobody knows which of the
  /// pages that this connection has in memory are on the disk, and a repeated fsync may report
  /// success although they are not.
  std::string lost_;
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
  SqliteStatement& bind(int parameter, const std::uint8_t* bytes, std::size_t size);
  /// Binds the value as it is there.
  SqliteStatement& bind(int parameter, const SqliteStatement& row, int column);
  SqliteStatement& bindNull(int parameter);
  template <typename T>
  SqliteStatement& bind(int parameter, const std::optional<T>& value) {
    return value ? bind(parameter, *value) : bindNull(parameter);
  }

  bool step();  ///< true: there is a row
  void run();   ///< runs to the end, and resets
  void reset();

  /// Columns count from 0; of the current row.
  std::int64_t integer(int column) const;
  std::optional<std::int64_t> optionalInteger(int column) const;
  bool isNull(int column) const;
  std::string text(int column) const;
  Bytes bytes(int column) const;
  const std::uint8_t* data(int column) const;  ///< bytes of a blob, until the next step
  std::size_t size(int column) const;          ///< size of a text or blob, in bytes

 private:
  void check(int code);

  SqliteConnection& connection_;
  sqlite3_stmt* statement_ = nullptr;
  bool is_reading_ = true;
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

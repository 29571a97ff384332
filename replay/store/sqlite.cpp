#include "replay/store/sqlite.hpp"

#include <sqlite3.h>

#include "replay/store/store.hpp"

namespace afterglow::replay {
namespace {

/// How long one process waits for another's transaction. An import of a large bag is one
/// transaction, but only its writing to the log excludes other writers; readers never wait.
constexpr int kBusyTimeout_ms = 10'000;

/// A path as SQLite's URI wants it.
std::string immutableUri(const std::string& path) {
  std::string uri = "file:";
  for (const char c : path) {
    const bool is_special = c == '%' || c == '?' || c == '#';
    if (is_special) {
      static const char* const digits = "0123456789ABCDEF";
      const auto byte = static_cast<unsigned char>(c);
      uri += {'%', digits[byte >> 4], digits[byte & 15]};
    } else {
      uri += c;
    }
  }
  return uri + "?immutable=1";
}

int flagsOf(SqliteAccess access) {
  switch (access) {
    case SqliteAccess::ReadOnly:
      return SQLITE_OPEN_READONLY;
    case SqliteAccess::ReadOnlyImmutable:
      return SQLITE_OPEN_READONLY | SQLITE_OPEN_URI;
    case SqliteAccess::ReadWriteCreate:
      return SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  }
  return SQLITE_OPEN_READONLY;
}

}  // namespace

SqliteConnection::SqliteConnection(const std::string& path, SqliteAccess access)
    : name_("sqlite:" + path) {
  const std::string file = access == SqliteAccess::ReadOnlyImmutable ? immutableUri(path) : path;
  // One thread at a time is the owner's job, so SQLite need not lock a second time.
  const int flags = flagsOf(access) | SQLITE_OPEN_NOMUTEX;
  if (sqlite3_open_v2(file.c_str(), &connection_, flags, nullptr) != SQLITE_OK) {
    const std::string reason =
        connection_ ? sqlite3_errmsg(connection_) : "not enough memory for a connection";
    sqlite3_close_v2(connection_);
    throw StoreError(name_ + ": cannot open the store: " + reason);
  }
  sqlite3_extended_result_codes(connection_, 1);
  sqlite3_busy_timeout(connection_, kBusyTimeout_ms);
  // The file may come from anybody: no SQL of its own may run, nothing may bend the schema.
  sqlite3_db_config(connection_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(connection_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_limit(connection_, SQLITE_LIMIT_ATTACHED, 0);
}

SqliteConnection::~SqliteConnection() { sqlite3_close_v2(connection_); }

void SqliteConnection::execute(const std::string& sql) {
  if (sqlite3_exec(connection_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    fail("run \"" + sql.substr(0, 60) + "\"");
  }
}

std::int64_t SqliteConnection::integer(const std::string& sql) {
  SqliteStatement statement(*this, sql);
  return statement.step() ? statement.integer(0) : 0;
}

std::int64_t SqliteConnection::lastInsertedId() const {
  return sqlite3_last_insert_rowid(connection_);
}

bool SqliteConnection::isInTransaction() const { return sqlite3_get_autocommit(connection_) == 0; }

void SqliteConnection::fail(const std::string& doing) const {
  std::string reason = sqlite3_errmsg(connection_);
  if ((sqlite3_errcode(connection_) & 0xff) == SQLITE_BUSY) {
    reason = "another process has been writing to it for " +
             std::to_string(kBusyTimeout_ms / 1000) + " s";
  }
  throw StoreError(name_ + ": cannot " + doing + ": " + reason);
}

// ------------------------------------------------------------------------------------- statements

SqliteStatement::SqliteStatement(SqliteConnection& connection, std::string_view sql)
    : connection_(connection) {
  const int code =
      sqlite3_prepare_v3(connection.connection_, sql.data(), static_cast<int>(sql.size()),
                         SQLITE_PREPARE_PERSISTENT, &statement_, nullptr);
  if (code != SQLITE_OK) connection.fail("read");
}

SqliteStatement::~SqliteStatement() { sqlite3_finalize(statement_); }

SqliteStatement& SqliteStatement::bind(int parameter, std::int64_t value) {
  check(sqlite3_bind_int64(statement_, parameter, value));
  return *this;
}

SqliteStatement& SqliteStatement::bind(int parameter, std::string_view text) {
  // A null pointer would bind NULL; an empty view may hold one.
  check(sqlite3_bind_text64(statement_, parameter, text.empty() ? "" : text.data(), text.size(),
                            SQLITE_STATIC, SQLITE_UTF8));
  return *this;
}

SqliteStatement& SqliteStatement::bind(int parameter, const Bytes& bytes) {
  if (bytes.empty()) {
    check(sqlite3_bind_zeroblob(statement_, parameter, 0));
  } else {
    check(sqlite3_bind_blob64(statement_, parameter, bytes.data(), bytes.size(), SQLITE_STATIC));
  }
  return *this;
}

SqliteStatement& SqliteStatement::bindNull(int parameter) {
  check(sqlite3_bind_null(statement_, parameter));
  return *this;
}

bool SqliteStatement::step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) check(code);
  return false;
}

void SqliteStatement::run() {
  const StatementScope scope(*this);
  step();
}

void SqliteStatement::reset() {
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

std::int64_t SqliteStatement::integer(int column) const {
  return sqlite3_column_int64(statement_, column);
}

std::optional<std::int64_t> SqliteStatement::optionalInteger(int column) const {
  if (sqlite3_column_type(statement_, column) == SQLITE_NULL) return std::nullopt;
  return integer(column);
}

std::string SqliteStatement::text(int column) const {
  const auto* begin = sqlite3_column_text(statement_, column);
  return begin ? std::string(begin, begin + size(column)) : std::string();
}

Bytes SqliteStatement::bytes(int column) const {
  const auto* begin = static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_, column));
  return begin ? Bytes(begin, begin + size(column)) : Bytes();
}

std::size_t SqliteStatement::size(int column) const {
  return static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
}

void SqliteStatement::check(int code) {
  if (code == SQLITE_OK) return;
  try {
    connection_.fail(sqlite3_stmt_readonly(statement_) ? "read" : "write");
  } catch (...) {
    reset();
    throw;
  }
}

// ----------------------------------------------------------------------------------- transactions

SqliteTransaction::SqliteTransaction(SqliteConnection& connection)
    : connection_(connection), is_outermost_(!connection.isInTransaction()) {
  // Immediate: to wait for another writer at the beginning, where waiting is possible.
  if (is_outermost_) connection_.execute("BEGIN IMMEDIATE");
}

SqliteTransaction::~SqliteTransaction() {
  if (!is_open_ || !is_outermost_ || !connection_.isInTransaction()) return;
  try {
    connection_.execute("ROLLBACK");
  } catch (const StoreError&) {
    // The transaction ends with the connection, and nothing of it stays either way.
  }
}

void SqliteTransaction::commit() {
  if (is_outermost_) connection_.execute("COMMIT");
  is_open_ = false;
}

}  // namespace afterglow::replay

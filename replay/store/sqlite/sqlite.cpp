#include "replay/store/sqlite/sqlite.hpp"

#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <thread>

#include "replay/store/checksum.hpp"
#include "replay/store/sqlite/store_files.hpp"

namespace afterglow::replay {
namespace {

/// The time that one process waits for another's transaction; readers never wait.
constexpr int kBusyTimeout_ms = 10'000;
/// The time between looks whether that has ended. SQLite's own handler soon looks only every 100
/// ms, and then misses the pauses of a process that writes much (store_import.hpp).
constexpr std::chrono::milliseconds kBusyPoll{2};
/// The time that a commit waits for readers when the log has grown too long.
constexpr int kReaderTimeout_ms = 200;

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

/// SQLite counts its memory under one lock, for which threads that read would wait at each row.
/// Nobody asks for the count.
const int kUncounted = sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0);

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

/// Computes checksum(BLOB) of store/checksum.hpp, for migrations.
void checksumInSql(sqlite3_context* context, int, sqlite3_value** arguments) {
  const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_value_blob(arguments[0]));
  const auto size = static_cast<std::size_t>(sqlite3_value_bytes(arguments[0]));
  sqlite3_result_int64(context, checksumOf(bytes, size));
}

/// The file may come from anybody: no SQL of its own may run, nothing may bend the schema. VACUUM
/// needs the one attached database.
void distrustFile(sqlite3* connection) {
  for (const auto& [option, value] :
       {std::pair(SQLITE_DBCONFIG_DEFENSIVE, 1), std::pair(SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0),
        std::pair(SQLITE_DBCONFIG_ENABLE_TRIGGER, 0), std::pair(SQLITE_DBCONFIG_ENABLE_VIEW, 0)}) {
    sqlite3_db_config(connection, option, value, nullptr);
  }
  for (const auto& [limit, value] :
       {std::pair(SQLITE_LIMIT_ATTACHED, 1), std::pair(SQLITE_LIMIT_SQL_LENGTH, 1 << 20),
        std::pair(SQLITE_LIMIT_COLUMN, 64), std::pair(SQLITE_LIMIT_EXPR_DEPTH, 100),
        std::pair(SQLITE_LIMIT_COMPOUND_SELECT, 20), std::pair(SQLITE_LIMIT_TRIGGER_DEPTH, 1)}) {
    sqlite3_limit(connection, limit, value);
  }
}

}  // namespace

SqliteConnection::SqliteConnection(const std::string& path, SqliteAccess access)
    : name_("sqlite:" + path) {
  if (access == SqliteAccess::ReadWriteCreate && path != ":memory:") {
    // SQLite would make it with the umask; its log gets the modes of the database.
    if (const int made = makePrivateFile(realFile(path)); made >= 0) ::close(made);
  }
  const std::string file = access == SqliteAccess::ReadOnlyImmutable ? immutableUri(path) : path;
  // One thread at a time is the owner's job, so SQLite need not lock a second time.
  const int flags = flagsOf(access) | SQLITE_OPEN_NOMUTEX;
  if (sqlite3_open_v2(file.c_str(), &connection_, flags, nullptr) != SQLITE_OK) {
    const int cause = connection_ ? sqlite3_system_errno(connection_) : ENOMEM;
    const std::string reason = cause ? std::strerror(cause) : sqlite3_errmsg(connection_);
    sqlite3_close_v2(connection_);
    throw StoreError(name_ + ": cannot open the store: " + reason);
  }
  sqlite3_extended_result_codes(connection_, 1);
  busy_timeout_ = std::chrono::milliseconds(kBusyTimeout_ms);
  sqlite3_busy_handler(connection_, onBusy, this);
  distrustFile(connection_);
  sqlite3_create_function(connection_, "checksum", 1,
                          SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_DIRECTONLY, nullptr,
                          checksumInSql, nullptr, nullptr);
}

SqliteConnection::~SqliteConnection() {
  prepared_.clear();
  sqlite3_close_v2(connection_);
}

SqliteStatement& SqliteConnection::prepared(std::string_view sql) {
  auto known = prepared_.find(sql);
  if (known == prepared_.end()) {
    auto statement = std::make_unique<SqliteStatement>(*this, sql);
    known = prepared_.emplace(sql, std::move(statement)).first;
  }
  known->second->reset();
  return *known->second;
}

void SqliteConnection::execute(const std::string& sql) {
  const int code = sqlite3_exec(connection_, sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) {
    noteFailure(code);
    // Of many statements the first line: an error is one.
    const std::size_t begin = std::min(sql.find_first_not_of('\n'), sql.size());
    fail("run \"" + sql.substr(begin, std::min<std::size_t>(sql.find('\n', begin) - begin, 60)) +
         "\"");
  }
}

std::int64_t SqliteConnection::integer(const std::string& sql) {
  SqliteStatement statement(*this, sql);
  return statement.step() ? statement.integer(0) : 0;
}

std::size_t SqliteConnection::readStart(unsigned char* bytes, std::size_t size) {
  sqlite3_file* file = nullptr;
  sqlite3_int64 length = 0;
  int code = sqlite3_file_control(connection_, "main", SQLITE_FCNTL_FILE_POINTER, &file);
  if (code == SQLITE_OK) code = file->pMethods->xFileSize(file, &length);
  const std::size_t count = std::min(size, static_cast<std::size_t>(length));
  if (code == SQLITE_OK) code = file->pMethods->xRead(file, bytes, static_cast<int>(count), 0);
  if (code != SQLITE_OK) refuse(std::string("cannot read the file: ") + sqlite3_errstr(code));
  return count;
}

std::int64_t SqliteConnection::lastInsertedId() const {
  return sqlite3_last_insert_rowid(connection_);
}

bool SqliteConnection::isInTransaction() const { return sqlite3_get_autocommit(connection_) == 0; }

std::int64_t SqliteConnection::changedRows() const {
#if SQLITE_VERSION_NUMBER >= 3037000
  return sqlite3_changes64(connection_);
#else
  return sqlite3_changes(connection_);  // of a statement: below two thousand millions
#endif
}

void SqliteConnection::foldLog(int fold, int longest) {
  fold_pages_ = fold;
  longest_log_ = longest;
  next_wait_ = longest;
  sqlite3_wal_hook(connection_, onCommit, this);
}

int SqliteConnection::onBusy(void* self, int times) {
  auto& store = *static_cast<SqliteConnection*>(self);
  const auto now = std::chrono::steady_clock::now();
  if (times == 0) store.busy_since_ = now;
  if (now - store.busy_since_ >= store.busy_timeout_) return 0;
  std::this_thread::sleep_for(kBusyPoll);
  return 1;
}

int SqliteConnection::onCommit(void* self, sqlite3* connection, const char* database, int pages) {
  auto& store = *static_cast<SqliteConnection*>(self);
  if (pages < store.fold_pages_) return SQLITE_OK;
  // The log can be folded while others read, but begun anew only when nobody reads. Readers of this
  // program read in short pages, so a short wait is enough. Another program that reads for long
  // makes the log grow, and a commit waits for it only now and then.
  const bool must_wait = pages >= store.next_wait_;
  if (pages < store.longest_log_) store.next_wait_ = store.longest_log_;
  if (must_wait) store.next_wait_ = pages + store.longest_log_;
  store.busy_timeout_ = std::chrono::milliseconds(must_wait ? kReaderTimeout_ms : 0);
  const int mode = must_wait ? SQLITE_CHECKPOINT_RESTART : SQLITE_CHECKPOINT_PASSIVE;
  const int code = sqlite3_wal_checkpoint_v2(connection, database, mode, nullptr, nullptr);
  store.busy_timeout_ = std::chrono::milliseconds(kBusyTimeout_ms);
  // If another process is folding, or the disk is full, the commits stay safe in the log.
  if ((code & 0xff) != SQLITE_IOERR) return SQLITE_OK;
  store.noteFailure(code);
  return code;
}

void SqliteConnection::noteFailure(int code) {
  if ((code & 0xff) == SQLITE_IOERR && lost_.empty()) lost_ = sqlite3_errstr(code);
}

void SqliteConnection::requireWritable() const {
  if (lost_.empty()) return;
  throw StoreError(name_ + ": cannot write: the disk failed (" + lost_ +
                   "); nothing more is written to the store until it is opened again");
}

void SqliteConnection::fail(const std::string& doing) {
  std::string reason = sqlite3_errmsg(connection_);
  if ((sqlite3_errcode(connection_) & 0xff) == SQLITE_BUSY) {
    reason = "another process has been writing to it for " +
             std::to_string(kBusyTimeout_ms / 1000) + " s";
  }
  const std::string text = name_ + ": cannot " + doing + ": " + reason;
  const int code = sqlite3_errcode(connection_) & 0xff;
  if (code == SQLITE_CORRUPT || code == SQLITE_TOOBIG) {
    throw SqliteDamage(text + "; \"afterglow store repair\" saves what can be read", reason);
  }
  if (code == SQLITE_CONSTRAINT) throw SqliteConstraint(text);
  if (code == SQLITE_BUSY || code == SQLITE_LOCKED) throw StoreBusy(text);
  throw StoreError(text);
}

// ------------------------------------------------------------------------------------- statements

SqliteStatement::SqliteStatement(SqliteConnection& connection, std::string_view sql)
    : connection_(connection) {
  const int code =
      sqlite3_prepare_v3(connection.connection_, sql.data(), static_cast<int>(sql.size()),
                         SQLITE_PREPARE_PERSISTENT, &statement_, nullptr);
  if (code != SQLITE_OK) connection.fail("read");
  is_reading_ = sqlite3_stmt_readonly(statement_) != 0;
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
  return bind(parameter, bytes.data(), bytes.size());
}

SqliteStatement& SqliteStatement::bind(int parameter, const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) {
    check(sqlite3_bind_zeroblob(statement_, parameter, 0));
  } else {
    check(sqlite3_bind_blob64(statement_, parameter, bytes, size, SQLITE_STATIC));
  }
  return *this;
}

SqliteStatement& SqliteStatement::bind(int parameter, const SqliteStatement& row, int column) {
  check(sqlite3_bind_value(statement_, parameter, sqlite3_column_value(row.statement_, column)));
  return *this;
}

SqliteStatement& SqliteStatement::bindNull(int parameter) {
  check(sqlite3_bind_null(statement_, parameter));
  return *this;
}

bool SqliteStatement::step() {
  if (!is_reading_) connection_.requireWritable();
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

bool SqliteStatement::isNull(int column) const {
  return sqlite3_column_type(statement_, column) == SQLITE_NULL;
}

std::int64_t SqliteStatement::integer(int column) const {
  return sqlite3_column_int64(statement_, column);
}

std::optional<std::int64_t> SqliteStatement::optionalInteger(int column) const {
  if (isNull(column)) return std::nullopt;
  return integer(column);
}

std::string SqliteStatement::text(int column) const {
  const auto* begin = sqlite3_column_text(statement_, column);
  return begin ? std::string(begin, begin + size(column)) : std::string();
}

Bytes SqliteStatement::bytes(int column) const {
  const auto* begin = data(column);
  return begin ? Bytes(begin, begin + size(column)) : Bytes();
}

const std::uint8_t* SqliteStatement::data(int column) const {
  return static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_, column));
}

std::size_t SqliteStatement::size(int column) const {
  return static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
}

void SqliteStatement::check(int code) {
  if (code == SQLITE_OK) return;
  if (!is_reading_) connection_.noteFailure(code);
  try {
    connection_.fail(is_reading_ ? "read" : "write");
  } catch (...) {
    reset();
    throw;
  }
}

// ----------------------------------------------------------------------------------- transactions

SqliteTransaction::SqliteTransaction(SqliteConnection& connection)
    : connection_(connection), is_outermost_(!connection.isInTransaction()) {
  // Immediate: to wait for another writer at the beginning, where waiting is possible.
  if (!is_outermost_) return;
  connection_.requireWritable();
  connection_.execute("BEGIN IMMEDIATE");
}

SqliteTransaction::~SqliteTransaction() {
  if (!is_open_ || !is_outermost_ || !connection_.isInTransaction()) return;
  try {
    connection_.execute("ROLLBACK");
  } catch (const std::exception&) {
    // The transaction ends with the connection, and nothing of it stays either way.
  }
}

void SqliteTransaction::commit() {
  if (is_outermost_) connection_.execute("COMMIT");
  is_open_ = false;
}

}  // namespace afterglow::replay

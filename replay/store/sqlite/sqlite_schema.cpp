#include "replay/store/sqlite/sqlite_schema.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "replay/store/sqlite/store_files.hpp"

namespace afterglow::replay {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kApplicationId = 0x4167776c;
constexpr std::uintmax_t kQuicklyChecked = 32 << 20;  ///< bytes

constexpr const char* kSqliteTables = R"(
CREATE TABLE definitions (
  id INTEGER PRIMARY KEY, type TEXT NOT NULL, md5 TEXT NOT NULL, text TEXT NOT NULL);
CREATE INDEX definitions_by_md5 ON definitions (md5);
CREATE TABLE recordings (
  id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, source TEXT NOT NULL, robot TEXT NOT NULL);
CREATE TABLE channels (
  id INTEGER PRIMARY KEY,
  recording INTEGER NOT NULL REFERENCES recordings,
  topic TEXT NOT NULL,
  definition INTEGER NOT NULL REFERENCES definitions,
  latching INTEGER NOT NULL,
  caller_id TEXT NOT NULL,
  UNIQUE (recording, topic, definition, latching, caller_id));
CREATE TABLE messages (
  id INTEGER PRIMARY KEY,
  recording INTEGER NOT NULL REFERENCES recordings,
  channel INTEGER NOT NULL REFERENCES channels,
  received_ns INTEGER NOT NULL,
  sequence INTEGER NOT NULL,
  header_stamp_ns INTEGER,
  size INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  bytes BLOB);
CREATE UNIQUE INDEX messages_in_order ON messages (recording, received_ns, sequence, channel);
CREATE TABLE chunks (
  id INTEGER PRIMARY KEY,
  message INTEGER NOT NULL REFERENCES messages,
  number INTEGER NOT NULL,
  checksum INTEGER NOT NULL,
  bytes BLOB NOT NULL,
  UNIQUE (message, number));
CREATE TABLE behaviors (
  id INTEGER PRIMARY KEY,
  key TEXT NOT NULL UNIQUE,
  recording INTEGER NOT NULL REFERENCES recordings,
  name TEXT NOT NULL,
  tree_path TEXT NOT NULL,
  parent INTEGER NOT NULL,
  attempt INTEGER NOT NULL,
  outcome TEXT NOT NULL,
  begin_ns INTEGER NOT NULL,
  end_ns INTEGER,
  wall_begin_ns INTEGER NOT NULL,
  robot TEXT NOT NULL,
  parameters TEXT NOT NULL,
  tags TEXT NOT NULL,
  calibration TEXT NOT NULL,
  topics TEXT NOT NULL,
  snapshot TEXT NOT NULL,
  remarks TEXT NOT NULL);
CREATE INDEX behaviors_by_begin ON behaviors (begin_ns);
CREATE INDEX behaviors_by_name ON behaviors (name, begin_ns);
CREATE INDEX behaviors_by_outcome ON behaviors (outcome, begin_ns);
CREATE INDEX behaviors_by_interval ON behaviors (recording, begin_ns, end_ns);
CREATE TABLE behavior_counts (
  behavior INTEGER NOT NULL REFERENCES behaviors,
  channel INTEGER NOT NULL REFERENCES channels,
  count INTEGER NOT NULL,
  first_ns INTEGER NOT NULL,
  last_ns INTEGER NOT NULL,
  PRIMARY KEY (behavior, channel)) WITHOUT ROWID;
CREATE TABLE files (sha256 TEXT PRIMARY KEY, contents BLOB NOT NULL);
)";

void makeSqliteTables(SqliteConnection& connection) { connection.execute(kSqliteTables); }

/// The first 100 bytes of a database file; SQLite file format, "The Database Header".
struct FileHeader {
  std::array<unsigned char, 100> bytes{};
  std::size_t size = 0;

  std::uint32_t number(std::size_t offset) const {
    return std::uint32_t{bytes[offset]} << 24 | std::uint32_t{bytes[offset + 1]} << 16 |
           std::uint32_t{bytes[offset + 2]} << 8 | bytes[offset + 3];
  }
  bool isSqlite() const {
    return size == bytes.size() && std::memcmp(bytes.data(), "SQLite format 3", 16) == 0;
  }
  std::uint32_t userVersion() const { return number(60); }
  std::uint32_t applicationId() const { return number(68); }
};

FileHeader readHeader(const fs::path& file) {
  SqliteConnection connection(file.string(), SqliteAccess::ReadOnlyImmutable);
  FileHeader header;
  header.size = connection.readStart(header.bytes.data(), header.bytes.size());
  return header;
}

/// Reads the header of a file that is no database for the moment: a loss of power may leave any
/// part of its first transaction, which the journal beside it takes back.
FileHeader rolledBack(const fs::path& file) {
  SqliteConnection(file.string(), SqliteAccess::ReadWriteCreate).integer("PRAGMA user_version");
  return readHeader(file);
}

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw StoreError("sqlite:" + path + ": not an Afterglow store: " + why);
}

/// Why this user may not; empty: it may.
std::string whyNoAccess(const fs::path& path, int wish) {
  const fs::path named = path.empty() ? "." : path;
  return faccessat(AT_FDCWD, named.c_str(), wish, AT_EACCESS) == 0 ? "" : std::strerror(errno);
}

bool hasLog(const std::string& real_path) {
  std::error_code error;
  const auto size = fs::file_size(real_path + "-wal", error);
  return !error && size > 0;
}

/// SQLite itself says only that it is unable to open a file, not which one and why.
void checkAccess(const std::string& path, OpenMode mode) {
  const std::string real = realFile(path);
  const fs::path folder = fs::path(real).parent_path();
  const auto refuse = [&](const std::string& text) {
    throw StoreError("sqlite:" + path + ": cannot open the store: " + text);
  };
  const std::string no_folder = whyNoAccess(folder, W_OK);
  std::error_code ignored;
  if (!fs::exists(real, ignored)) {
    if (!no_folder.empty()) refuse("it cannot be made in " + folder.string() + ": " + no_folder);
    return;
  }
  const bool is_read = mode == OpenMode::ReadOnly;
  const std::string no_file = whyNoAccess(real, is_read ? R_OK : R_OK | W_OK);
  const std::string no_use = std::string("the file is not to be ") + (is_read ? "read" : "written");
  if (!no_file.empty()) refuse(no_use + ": " + no_file);
  const std::string needs = ", where SQLite has to keep files beside it, is not to be written: ";
  if (!is_read && !no_folder.empty()) refuse("its folder " + folder.string() + needs + no_folder);
  const bool needs_folder = hasLog(real) && !fs::exists(real + "-shm", ignored);
  if (is_read && !no_folder.empty() && needs_folder) {
    refuse("its folder " + folder.string() + needs + no_folder +
           "; copy it and its -wal elsewhere");
  }
  struct stat file {};
  if (!is_read && stat(real.c_str(), &file) == 0 && file.st_nlink > 1) {
    refuse("the file has " + std::to_string(file.st_nlink) +
           " names (hard links), and SQLite a log for each, which would not fit together");
  }
}

/// Looks without SQL, for which SQLite may leave -wal and -shm files beside a database. The file
/// itself always has the version: tables are made before WAL mode is entered.
void checkFile(const std::string& path, OpenMode mode) {
  const fs::path file(path);
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::none) {
    throw StoreError("sqlite:" + path + ": cannot reach the store: " + error.message());
  }
  if (!fs::exists(status)) {
    if (mode != OpenMode::ReadOnly) return;
    throw StoreError("sqlite:" + path + ": no such store");
  }
  if (fs::is_directory(status)) refuse(path, "it is a folder");
  if (!fs::is_regular_file(status)) refuse(path, "it is no regular file");
  if (const std::string why = whyNoAccess(file, R_OK); !why.empty()) {
    throw StoreError("sqlite:" + path + ": cannot open the store: the file is not to be read: " +
                     why);
  }
  FileHeader header = readHeader(file);
  if (!header.isSqlite() && fs::exists(path + "-journal", error)) {
    if (mode == OpenMode::ReadOnly) refuse(path, "the power went, or its program, as it was made");
    header = rolledBack(file);
  }
  if (header.size == 0) {
    if (mode != OpenMode::ReadOnly) return;
    refuse(path, "the file is empty");
  }
  if (!header.isSqlite()) refuse(path, "the file is no SQLite database");
  if (header.applicationId() != kApplicationId) {
    refuse(path, "the file is another program's SQLite database");
  }
  if (header.userVersion() > kStoreVersion) {
    throw StoreError("sqlite:" + path + ": the store has version " +
                     std::to_string(header.userVersion()) + ", this program knows up to " +
                     std::to_string(kStoreVersion));
  }
  if (header.userVersion() < kOldestReadVersion && mode == OpenMode::ReadOnly) {
    throw StoreError("sqlite:" + path + ": the store has version " +
                     std::to_string(header.userVersion()) + "; \"afterglow store compact --store " +
                     path + "\" makes it one of version " + std::to_string(kStoreVersion));
  }
}

void makeFolder(const std::string& path) {
  try {
    makePrivateFolder(fs::path(path).parent_path());
  } catch (const StoreError& error) {
    throw StoreError("sqlite:" + path + ": " + error.what());
  }
}

/// Returns true on a read-only medium, where SQLite cannot make the -shm file that a WAL database
/// needs. It opens the database without that file where nobody can write and no WAL is left to
/// read.
bool isFrozen(const std::string& path) {
  const std::string real = realFile(path);
  return !hasLog(real) && !whyNoAccess(fs::path(real).parent_path(), W_OK).empty();
}

// ---------------------------------------------------------------------- version 1 to this version

constexpr const char* kSetAside = R"(
DROP INDEX definitions_by_md5;
DROP INDEX messages_in_order;
DROP INDEX behaviors_by_begin;
ALTER TABLE definitions RENAME TO old_definitions;
ALTER TABLE recordings RENAME TO old_recordings;
ALTER TABLE channels RENAME TO old_channels;
ALTER TABLE messages RENAME TO old_messages;
ALTER TABLE behaviors RENAME TO old_behaviors;
)";

/// The robot of a recording is that of its behaviors. Version 1 did not keep the wall clock of a
/// behavior's begin.
constexpr const char* kCopy = R"(
INSERT INTO definitions SELECT id, type, md5, text FROM old_definitions;
INSERT INTO recordings SELECT id, lower(hex(randomblob(16))), source,
  coalesce((SELECT max(robot) FROM old_behaviors b WHERE b.recording = r.id), '')
  FROM old_recordings r;
INSERT INTO channels SELECT id, recording, topic, definition, latching, caller_id
  FROM old_channels;
INSERT INTO behaviors SELECT id, lower(hex(randomblob(16))), recording, name, tree_path, parent,
  attempt, outcome, begin_ns, end_ns, 0, robot, parameters, tags, calibration, topics, '{}', '[]'
  FROM old_behaviors;
)";

constexpr const char* kDropOld = R"(
DROP TABLE old_behaviors;
DROP TABLE old_messages;
DROP TABLE old_channels;
DROP TABLE old_recordings;
DROP TABLE old_definitions;
)";

void copyMessages(SqliteConnection& connection) {
  const std::string chunk = std::to_string(kSqliteChunkBytes);
  connection.execute(
      "INSERT INTO messages SELECT id, recording, channel, received_ns, sequence, header_stamp_ns, "
      "length(bytes), checksum(bytes), iif(length(bytes) > " +
      chunk +
      ", NULL, bytes) "
      "FROM old_messages");
  connection.execute(
      "INSERT INTO chunks (message, number, checksum, bytes) "
      "WITH RECURSIVE piece (message, number) AS ("
      "  SELECT id, 0 FROM messages WHERE bytes IS NULL UNION ALL "
      "  SELECT message, number + 1 FROM piece "
      "  JOIN messages ON id = message WHERE (number + 1) * " +
      chunk +
      " < size) "
      "SELECT message, number, checksum(substr(bytes, number * " +
      chunk + " + 1, " + chunk +
      ")), "
      "substr(bytes, number * " +
      chunk + " + 1, " + chunk +
      ") "
      "FROM piece JOIN old_messages ON id = message");
}

/// Makes the tables of this version of those of version 1, in the transaction that is open; the
/// caller sets the version. Recordings and behaviors are given keys. Needs as much space again as
/// the store has.
void migrateFromVersion1(SqliteConnection& connection) {
  connection.execute(kSetAside);
  makeSqliteTables(connection);
  connection.execute(kCopy);
  copyMessages(connection);
  connection.execute(
      "INSERT INTO behavior_counts SELECT b.id, channel, count(*), min(received_ns), "
      "max(received_ns) FROM behaviors b JOIN messages m ON m.recording = b.recording "
      "AND received_ns >= begin_ns AND received_ns < coalesce(end_ns, 9223372036854775807) "
      "GROUP BY b.id, channel");
  connection.execute(kDropOld);
}

// ----------------------------------------------------------------------------------------- opening

/// Makes an empty file a store, and an older store one of this version.
void makeCurrent(SqliteConnection& connection) {
  SqliteTransaction transaction(connection);
  const std::int64_t version = connection.integer("PRAGMA user_version");
  if (version == kStoreVersion) return;  // another process was faster
  if (version == 0) makeSqliteTables(connection);
  if (version == 1) migrateFromVersion1(connection);
  if (version == 2) connection.execute("DROP TABLE field_blocks");
  connection.execute("PRAGMA application_id = " + std::to_string(kApplicationId));
  connection.execute("PRAGMA user_version = " + std::to_string(kStoreVersion));
  transaction.commit();
}

/// A store has nothing in it that could run when it is read: triggers, views, virtual tables.
void refuseForeignObjects(SqliteConnection& connection, const std::string& path) {
  SqliteStatement query(connection,
                        "SELECT type, name FROM sqlite_schema WHERE type IN ('trigger', 'view') "
                        "OR sql LIKE 'CREATE VIRTUAL%' LIMIT 1");
  if (query.step()) refuse(path, "it holds the " + query.text(0) + " " + query.text(1));
}

/// A recorder does not write into a damaged store. Checking a larger one would take too long: its
/// damage is found when it is read.
void refuseDamage(SqliteConnection& connection, const std::string& path) {
  std::error_code error;
  if (fs::file_size(path, error) > kQuicklyChecked || error) return;
  SqliteStatement check(connection, "PRAGMA quick_check(1)");
  if (check.step() && check.text(0) != "ok") {
    throw StoreError("sqlite:" + path + ": the store is damaged (" + check.text(0) +
                     "); \"afterglow store repair --store " + path + "\" saves what can be read");
  }
}

void configure(SqliteConnection& connection, const std::string& path, OpenMode mode) {
  connection.execute("PRAGMA cell_size_check = ON");
  connection.execute("PRAGMA cache_size = -16384");  // KiB
  refuseForeignObjects(connection, path);
  if (mode == OpenMode::ReadOnly) return;
  if (mode == OpenMode::Record) refuseDamage(connection, path);
  // Takes effect in a new file. With pages of 4 KiB, writing a second's messages takes twice as
  // long; pages larger than these gain little and make small commits large.
  connection.execute("PRAGMA page_size = 16384");
  if (connection.integer("PRAGMA user_version") != kStoreVersion) makeCurrent(connection);
  connection.execute("PRAGMA journal_mode = WAL");
  // A batch whose append() has returned survives a loss of power, not only the end of the process.
  connection.execute("PRAGMA synchronous = FULL");
  connection.execute("PRAGMA journal_size_limit = 67108864");
}

}  // namespace

std::unique_ptr<SqliteConnection> openSqliteStore(const std::string& path, OpenMode mode) {
  const bool is_file = path != ":memory:";
  SqliteAccess access = SqliteAccess::ReadWriteCreate;
  if (is_file) {
    checkFile(path, mode);
    if (mode != OpenMode::ReadOnly) makeFolder(realFile(path));
    checkAccess(path, mode);
    if (mode == OpenMode::ReadOnly) {
      access = isFrozen(path) ? SqliteAccess::ReadOnlyImmutable : SqliteAccess::ReadOnly;
    }
  }
  auto connection = std::make_unique<SqliteConnection>(path, access);
  configure(*connection, path, mode);
  return connection;
}

}  // namespace afterglow::replay

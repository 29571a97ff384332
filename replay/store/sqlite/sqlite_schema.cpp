#include "replay/store/sqlite/sqlite_schema.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "replay/store/sqlite/sqlite_migration.hpp"

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
CREATE TABLE field_blocks (
  channel INTEGER NOT NULL REFERENCES channels,
  first_ns INTEGER NOT NULL,
  id INTEGER NOT NULL,
  last_ns INTEGER NOT NULL,
  is_whole INTEGER NOT NULL,
  ranges BLOB NOT NULL,
  bloom BLOB NOT NULL,
  PRIMARY KEY (channel, first_ns, id)) WITHOUT ROWID;
CREATE TABLE files (sha256 TEXT PRIMARY KEY, contents BLOB NOT NULL);
)";

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
  FileHeader header;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    throw StoreError("sqlite:" + file.string() +
                     ": cannot open the store: " + std::strerror(errno));
  }
  stream.read(reinterpret_cast<char*>(header.bytes.data()),
              static_cast<std::streamsize>(header.bytes.size()));
  header.size = static_cast<std::size_t>(stream.gcount());
  return header;
}

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
  throw StoreError("sqlite:" + path + ": not an Afterglow store: " + why);
}

/// Looked at without SQLite, which may leave -wal and -shm files beside a database that it opens.
/// Tables are made before WAL mode is entered, so the file itself always tells.
void checkFile(const std::string& path, OpenMode mode) {
  const fs::path file(path);
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) {
    if (mode != OpenMode::ReadOnly) return;
    throw StoreError("sqlite:" + path + ": no such store");
  }
  if (fs::is_directory(status)) refuse(path, "it is a folder");
  if (!fs::is_regular_file(status)) refuse(path, "it is no regular file");
  const FileHeader header = readHeader(file);
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
  if (header.userVersion() < kStoreVersion && mode == OpenMode::ReadOnly) {
    throw StoreError("sqlite:" + path + ": the store has version " +
                     std::to_string(header.userVersion()) + "; \"afterglow store compact --store " +
                     path + "\" makes it one of version " + std::to_string(kStoreVersion));
  }
}

void makeFolder(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) fs::create_directories(folder, error);
  if (error) {
    throw StoreError("sqlite:" + path + ": cannot make the folder " + folder.string() + ": " +
                     error.message());
  }
}

/// On a read-only medium SQLite cannot make the -shm file that a WAL database needs; with nobody to
/// write and no WAL left to read, none is needed.
bool isFrozen(const std::string& path) {
  std::error_code error;
  const auto wal_size = fs::file_size(path + "-wal", error);
  if (!error && wal_size > 0) return false;
  const fs::path folder = fs::path(path).parent_path();
  return faccessat(AT_FDCWD, folder.empty() ? "." : folder.c_str(), W_OK, AT_EACCESS) != 0;
}

/// Makes an empty file a store, and an older store one of this version.
void makeCurrent(SqliteConnection& connection) {
  SqliteTransaction transaction(connection);
  const std::int64_t version = connection.integer("PRAGMA user_version");
  if (version == kStoreVersion) return;  // another process was faster
  if (version == 0) {
    makeSqliteTables(connection);
  } else {
    migrateFromVersion1(connection);
  }
  connection.execute("PRAGMA application_id = " + std::to_string(kApplicationId));
  connection.execute("PRAGMA user_version = " + std::to_string(kStoreVersion));
  transaction.commit();
}

/// Nothing that could run as a store is read: triggers, views, tables that are programs.
void refuseForeignObjects(SqliteConnection& connection, const std::string& path) {
  SqliteStatement query(connection,
                        "SELECT type, name FROM sqlite_schema WHERE type IN ('trigger', 'view') "
                        "OR sql LIKE 'CREATE VIRTUAL%' LIMIT 1");
  if (query.step()) refuse(path, "it holds the " + query.text(0) + " " + query.text(1));
}

/// A recorder does not write into what is damaged. Larger stores would take too long to look at:
/// what is damaged there is found when it is read.
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
  // For a file that is made now. Of pages of 4 KiB a second's messages are so many that writing
  // them takes twice as long; larger ones gain little and make small commits large.
  connection.execute("PRAGMA page_size = 16384");
  if (connection.integer("PRAGMA user_version") != kStoreVersion) makeCurrent(connection);
  connection.execute("PRAGMA journal_mode = WAL");
  // A batch that append() returned from survives a loss of power, not just of the process.
  connection.execute("PRAGMA synchronous = FULL");
  connection.execute("PRAGMA journal_size_limit = 67108864");
}

}  // namespace

void makeSqliteTables(SqliteConnection& connection) { connection.execute(kSqliteTables); }

std::unique_ptr<SqliteConnection> openSqliteStore(const std::string& path, OpenMode mode) {
  const bool is_file = path != ":memory:";
  SqliteAccess access = SqliteAccess::ReadWriteCreate;
  if (is_file) {
    checkFile(path, mode);
    if (mode != OpenMode::ReadOnly) makeFolder(path);
    if (mode == OpenMode::ReadOnly) {
      access = isFrozen(path) ? SqliteAccess::ReadOnlyImmutable : SqliteAccess::ReadOnly;
    }
  }
  auto connection = std::make_unique<SqliteConnection>(path, access);
  configure(*connection, path, mode);
  return connection;
}

}  // namespace afterglow::replay

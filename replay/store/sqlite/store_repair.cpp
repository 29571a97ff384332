#include "replay/store/sqlite/store_repair.hpp"

#include <algorithm>
#include <filesystem>

#include "replay/store/sqlite/behavior_counts.hpp"
#include "replay/store/sqlite/damage_ranges.hpp"
#include "replay/store/sqlite/recorder_lock.hpp"
#include "replay/store/sqlite/salvage.hpp"
#include "replay/store/sqlite/sqlite_message_reader.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"

namespace afterglow::replay {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kRowsInTransaction = 2000;

class Repair {
 public:
  Repair(SqliteConnection& from, SqliteConnection& to, const StoreProgress& progress)
      : from_(from), to_(to), progress_(progress) {}

  StoreRepair run() {
    to_.execute("BEGIN");
    copyTable("definitions", "id, type, md5, text");
    copyTable("recordings", "id, key, source, robot");
    copyTable("channels", "id, recording, topic, definition, latching, caller_id");
    copyTable("behaviors",
              "id, key, recording, name, tree_path, parent, attempt, outcome, begin_ns, end_ns, "
              "wall_begin_ns, robot, parameters, tags, calibration, topics, snapshot, remarks");
    copyTable("files", "rowid, sha256, contents");
    copyImports();
    copyMessages();
    restoreReferences();
    to_.execute("COMMIT");
    nameLostMessages();
    return std::move(repair_);
  }

 private:
  /// The row as it is; a row that breaks a rule of the new table counts as damaged.
  bool copyRow(SqliteStatement& insert, const SqliteStatement& row, int columns) {
    try {
      for (int i = 0; i < columns; ++i) insert.bind(i + 1, row, i);
      insert.run();
      return true;
    } catch (const SqliteConstraint&) {
      return false;
    }
  }

  void copyTable(const std::string& table, const std::string& columns) {
    SalvagedTable rows(from_, columns, table);
    const auto count = static_cast<int>(std::count(columns.begin(), columns.end(), ',')) + 1;
    SqliteStatement insert(to_, insertSql(table, columns, count));
    std::uint64_t refused = 0;
    const bool is_whole = rows.read(
        [&](const SqliteStatement& row) { refused += copyRow(insert, row, count) ? 0 : 1; });
    if (!is_whole) repair_.lost.push_back("some of the " + table + " cannot be read");
    if (refused > 0) repair_.lost.push_back(std::to_string(refused) + " damaged " + table);
  }

  /// What was left of them is still to be dropped.
  void copyImports() {
    if (from_.integer("SELECT count(*) FROM sqlite_schema WHERE name = 'imports'") == 0) return;
    to_.execute("CREATE TABLE imports (recording INTEGER PRIMARY KEY)");
    copyTable("imports", "recording");
  }

  static std::string insertSql(const std::string& table, const std::string& columns, int count) {
    std::string values = "?1";
    for (int i = 2; i <= count; ++i) values += ", ?" + std::to_string(i);
    return "INSERT INTO " + table + " (" + columns + ") VALUES (" + values + ")";
  }

  void copyMessages() {
    const std::string columns =
        "id, recording, channel, received_ns, sequence, header_stamp_ns, size, checksum, bytes";
    SalvagedTable rows(from_, columns, "messages");
    SqliteMessageReader reader(from_);
    SqliteStatement insert(to_, insertSql("messages", columns, 9));
    std::uint64_t seen = 0;
    gaps_ = !rows.read([&](const SqliteStatement& row) {
      const auto contents = reader.read(row.integer(0));
      if (!contents.problem.empty()) {
        damaged_.add(row.integer(2), row.integer(3), contents.problem);
      } else if (copyRow(insert, row, 9)) {
        if (row.isNull(8)) copyChunks(row.integer(0));
        ++repair_.messages;
      }
      if (++seen % kRowsInTransaction == 0) {
        to_.execute("COMMIT");
        to_.execute("BEGIN");
        if (progress_) progress_(seen, seen);
      }
    });
  }

  void copyChunks(std::int64_t message) {
    SqliteStatement& chunks = from_.prepared(
        "SELECT message, number, checksum, bytes FROM chunks WHERE message = ?1 ORDER BY number");
    SqliteStatement& insert = to_.prepared(
        "INSERT INTO chunks (message, number, checksum, bytes) VALUES (?1, ?2, ?3, ?4)");
    const StatementScope scope(chunks);
    chunks.bind(1, message);
    while (chunks.step()) copyRow(insert, chunks, 4);
  }

  /// Messages without their channel cannot be read: they are as lost as their channel. A recording
  /// is hardly more than its number.
  void restoreReferences() {
    to_.execute("DELETE FROM channels WHERE definition NOT IN (SELECT id FROM definitions)");
    to_.execute(
        "DELETE FROM chunks WHERE message IN (SELECT id FROM messages "
        "WHERE bytes IS NULL AND channel NOT IN (SELECT id FROM channels))");
    to_.execute("DELETE FROM messages WHERE channel NOT IN (SELECT id FROM channels)");
    repair_.messages -= static_cast<std::uint64_t>(to_.changedRows());
    to_.execute(
        "INSERT INTO recordings SELECT DISTINCT recording, lower(hex(randomblob(16))), '', '' "
        "FROM (SELECT recording FROM channels UNION SELECT recording FROM behaviors) "
        "WHERE recording NOT IN (SELECT id FROM recordings)");
    if (const auto made = to_.changedRows(); made > 0) {
      repair_.lost.push_back("where " + std::to_string(made) + " recordings come from");
    }
    to_.execute(
        "INSERT INTO field_blocks SELECT id, -9223372036854775808, 0, 9223372036854775807, 0, x'', "
        "x'' FROM channels");  // no index: every message is looked at
    SqliteStatement behaviors(to_, "SELECT id FROM behaviors");
    while (behaviors.step()) countBehavior(to_, behaviors.integer(0));
  }

  /// The index of a message tells of it when its row is gone.
  void nameLostMessages() {
    SqliteStatement& kept = to_.prepared("SELECT 1 FROM messages WHERE id = ?1");
    DamageRanges lost;
    try {
      SqliteStatement index(from_,
                            "SELECT id, channel, received_ns FROM messages "
                            "INDEXED BY messages_in_order ORDER BY recording, received_ns");
      while (gaps_ && index.step()) {
        const StatementScope scope(kept);
        if (!kept.bind(1, index.integer(0)).step()) {
          lost.add(index.integer(1), index.integer(2), "it cannot be read");
        }
      }
    } catch (const SqliteDamage&) {
      repair_.lost.emplace_back("the index of the messages is damaged, too: more may be lost");
    }
    for (const auto& line : (gaps_ ? lost : damaged_).lines(from_, "lost")) {
      repair_.lost.push_back(line);
    }
  }

  SqliteConnection& from_;
  SqliteConnection& to_;
  const StoreProgress& progress_;
  StoreRepair repair_;
  DamageRanges damaged_;
  bool gaps_ = false;
};

/// PATH.damaged, or PATH.damaged.2 and so on where that is taken.
std::string freePath(const std::string& path) {
  std::string free = path + ".damaged";
  for (int i = 2; fs::exists(free); ++i) free = path + ".damaged." + std::to_string(i);
  return free;
}

void move(const std::string& from, const std::string& to) {
  for (const char* suffix : {"-wal", "-shm", ""}) {
    if (fs::exists(from + suffix)) fs::rename(from + suffix, to + suffix);
  }
}

void removeStore(const std::string& path) {
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(path + suffix, ignored);
}

}  // namespace

StoreRepair repairStore(const std::string& path, const StoreProgress& progress) {
  const std::string copy = path + ".repaired";
  if (!fs::exists(path)) throw StoreError("sqlite:" + path + ": no such store");
  const RecorderLock lock(path);
  StoreRepair repair;
  try {
    const auto from = openSqliteStore(path, OpenMode::ReadOnly);
    removeStore(copy);
    const auto to = openSqliteStore(copy, OpenMode::ReadWrite);
    repair = Repair(*from, *to, progress).run();
    to->execute("PRAGMA wal_checkpoint(TRUNCATE)");
  } catch (...) {
    removeStore(copy);
    throw;
  }
  repair.damaged_path = freePath(path);
  try {
    move(path, repair.damaged_path);
    move(copy, path);
  } catch (const fs::filesystem_error& error) {
    throw StoreError("sqlite:" + path + ": cannot put the repaired store " + copy +
                     " in its place: " + error.code().message());
  }
  return repair;
}

}  // namespace afterglow::replay

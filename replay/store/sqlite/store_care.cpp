#include "replay/store/sqlite/store_care.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>

#include "replay/query/time_text.hpp"
#include "replay/store/checksum.hpp"
#include "replay/store/sqlite/store_files.hpp"
#include "replay/store/sqlite/behavior_counts.hpp"
#include "replay/store/sqlite/sqlite_cursor.hpp"
#include "replay/store/sqlite/sqlite_imports.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"

namespace afterglow::replay {
namespace {

namespace fs = std::filesystem;

// -------------------------------------------------------------------------------------- statistics

std::uint64_t fileSize(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  return error ? 0 : size;
}

std::uint64_t number(SqliteConnection& connection, const std::string& sql) {
  return static_cast<std::uint64_t>(connection.integer(sql));
}

std::vector<StoreStats::Topic> topicStats(SqliteConnection& connection) {
  SqliteStatement query(connection,
                        "SELECT topic, type, sum(n), sum(total) FROM (SELECT channel, "
                        "count(*) AS n, sum(size) AS total FROM messages GROUP BY channel) "
                        "JOIN channels c ON c.id = channel JOIN definitions d ON d.id = definition "
                        "GROUP BY topic, type ORDER BY 4 DESC, topic");
  std::vector<StoreStats::Topic> topics;
  while (query.step()) {
    topics.push_back({query.text(0), query.text(1), static_cast<std::uint64_t>(query.integer(2)),
                      static_cast<std::uint64_t>(query.integer(3))});
  }
  return topics;
}

std::vector<StoreStats::Held> largestBehaviors(SqliteConnection& connection) {
  SqliteStatement query(
      connection,
      "SELECT b.id, name, begin_ns, count(*), sum(size) FROM behaviors b JOIN messages m "
      "ON m.recording = b.recording AND received_ns >= begin_ns "
      "AND received_ns < coalesce(end_ns, 9223372036854775807) "
      "GROUP BY b.id ORDER BY 5 DESC, b.id LIMIT 10");
  std::vector<StoreStats::Held> behaviors;
  while (query.step()) {
    behaviors.push_back({query.integer(0), query.text(1), Stamp{query.integer(2)},
                         static_cast<std::uint64_t>(query.integer(3)),
                         static_cast<std::uint64_t>(query.integer(4))});
  }
  return behaviors;
}

// ---------------------------------------------------------------------------------------- problems

std::string channelName(SqliteConnection& connection, std::int64_t channel) {
  try {
    SqliteStatement query(connection, "SELECT recording, topic FROM channels WHERE id = ?1");
    if (query.bind(1, channel).step()) {
      return "recording " + std::to_string(query.integer(0)) + ", " + query.text(1);
    }
  } catch (const SqliteDamage&) {
    // Its row is damaged, too.
  }
  return "channel " + std::to_string(channel);
}

/// Damaged or lost messages in words, a line for each topic.
class DamageRanges {
 public:
  void add(std::int64_t channel, std::int64_t received_ns, const std::string& problem) {
    Range& range = ranges_[channel];
    if (range.count++ == 0) range = {1, received_ns, received_ns, problem};
    range.first_ns = std::min(range.first_ns, received_ns);
    range.last_ns = std::max(range.last_ns, received_ns);
  }

  /// `damaged`: what has become of them, "damaged" or "lost". The names of topics come from the
  /// store of `connection`.
  std::vector<std::string> lines(SqliteConnection& connection, const std::string& damaged) const {
    std::vector<std::string> lines;
    for (const auto& [channel, range] : ranges_) {
      std::string line = channelName(connection, channel) + ": ";
      if (range.count == 1) {
        line += "a message is " + damaged + ", of " + timeText(Stamp{range.first_ns});
      } else {
        line += std::to_string(range.count) + " messages are " + damaged + ", from " +
                timeText(Stamp{range.first_ns}) + " to " + timeText(Stamp{range.last_ns});
      }
      lines.push_back(line + ": " + range.problem);
    }
    return lines;
  }

 private:
  struct Range {
    std::uint64_t count = 0;
    std::int64_t first_ns = 0, last_ns = 0;
    std::string problem;  ///< problem of the first
  };
  std::map<std::int64_t, Range> ranges_;  ///< ranges by channel
};

// ------------------------------------------------------------------------------------------- check

constexpr std::uint64_t kMessagesBetweenReports = 1000;

/// Checks in several looks; each reports its problems; a look that damage ends is a problem, too,
/// and the next one begins.
class Checker {
 public:
  Checker(SqliteConnection& connection, const StoreProgress& progress)
      : connection_(connection), progress_(progress) {}

  StoreCheck run() {
    look("the database", [this] { checkStructure(); });
    look("references", [this] { checkReferences(); });
    look("messages", [this] { checkMessages(); });
    look("behaviors", [this] { checkBehaviors(); });
    look("files", [this] { checkFiles(); });
    return std::move(check_);
  }

 private:
  template <typename Look>
  void look(const std::string& what, const Look& take) {
    try {
      take();
    } catch (const SqliteDamage& damage) {
      check_.problems.push_back(what + " cannot be read on: " + damage.reason());
    }
  }

  void checkStructure() {
    SqliteStatement query(connection_, "PRAGMA integrity_check(100)");
    while (query.step()) {
      if (query.text(0) != "ok") check_.problems.push_back("the database: " + query.text(0));
    }
  }

  void checkReferences() {
    SqliteStatement query(connection_,
                          "SELECT \"table\", parent, count(*) FROM pragma_foreign_key_check() "
                          "GROUP BY 1, 2");
    while (query.step()) {
      check_.problems.push_back(query.text(0) + ": " + query.text(2) + " refer to " +
                                query.text(1) + " that are not there");
    }
  }

  void checkMessages() {
    const auto total =
        static_cast<std::uint64_t>(connection_.integer("SELECT count(*) FROM messages"));
    SqliteMessageReader reader(connection_);
    DamageRanges damaged;
    // In queries of a thousand rows: while one runs, the log of commits cannot be begun anew, and a
    // recorder would make it grow.
    std::int64_t last = 0;
    SqliteStatement query(connection_,
                          "SELECT id, channel, received_ns FROM messages WHERE id > ?1 "
                          "ORDER BY id LIMIT ?2");
    for (bool is_end = false; !is_end;) {
      const StatementScope scope(query);
      query.bind(1, last).bind(2, std::int64_t{kMessagesBetweenReports});
      is_end = true;
      while (query.step()) {
        is_end = false;
        last = query.integer(0);
        const auto contents = reader.read(last);
        if (!contents.problem.empty()) {
          damaged.add(query.integer(1), query.integer(2), contents.problem);
        }
        ++check_.messages;
      }
      if (progress_) progress_(check_.messages, std::max(total, check_.messages));
    }
    for (auto& line : damaged.lines(connection_, "damaged")) {
      check_.problems.push_back(std::move(line));
    }
  }

  /// `sql` yields ids and names of behaviors of which `problem` is true.
  void findBehaviors(const std::string& problem, const std::string& sql) {
    SqliteStatement query(connection_, "SELECT id, name FROM behaviors b WHERE " + sql);
    while (query.step()) {
      check_.problems.push_back("behavior " + query.text(0) + " (" + query.text(1) +
                                "): " + problem);
    }
  }

  void checkBehaviors() {
    findBehaviors("it ends before it begins", "end_ns < begin_ns");
    findBehaviors("its parent is not there",
                  "parent <> 0 AND NOT EXISTS (SELECT 1 FROM behaviors p WHERE p.id = b.parent)");
    for (const char* column :
         {"parameters", "tags", "calibration", "topics", "snapshot", "remarks"}) {
      findBehaviors(std::string(column) + " is not JSON",
                    std::string("NOT json_valid(") + column + ")");
    }
    findBehaviors(
        "its messages are not as many as were counted",
        "(SELECT count(*) FROM messages m WHERE m.recording = b.recording "
        " AND received_ns >= begin_ns AND received_ns < coalesce(end_ns, 9223372036854775807)) "
        "IS NOT (SELECT coalesce(sum(count), 0) FROM behavior_counts WHERE behavior = b.id)");
  }

  void checkFiles() {
    SqliteStatement query(connection_, "SELECT sha256, contents FROM files");
    while (query.step()) {
      if (sha256(query.bytes(1)) != query.text(0)) {
        check_.problems.push_back("the file of SHA-256 " + query.text(0) + " has another");
      }
    }
  }

  SqliteConnection& connection_;
  const StoreProgress& progress_;
  StoreCheck check_;
};

// ------------------------------------------------------------------------------------------ repair

/// Reads a table of a damaged database by row number. Where a page cannot be read, reading goes on
/// with the first row behind it, which is found by doubling steps and then halving them.
class SalvagedTable {
 public:
  /// `columns` of `table`; the row number, "rowid", must be the first. The connection must outlive
  /// it.
  SalvagedTable(SqliteConnection& connection, const std::string& columns, const std::string& table)
      : rows_(connection,
              "SELECT " + columns + " FROM " + table + " WHERE rowid >= ?1 ORDER BY rowid"),
        next_(std::numeric_limits<std::int64_t>::min()) {}

  /// Calls `take` with each row that can be read. False: there were gaps.
  bool read(const std::function<void(const SqliteStatement& row)>& take) {
    bool is_whole = true;
    while (!readOn(take)) {
      is_whole = false;
      const auto next = behindGap();
      if (!next) break;
      next_ = *next;
    }
    return is_whole;
  }

 private:
  /// False: damage stopped it.
  bool readOn(const std::function<void(const SqliteStatement& row)>& take) {
    const StatementScope scope(rows_);
    rows_.bind(1, next_);
    for (;;) {
      try {
        if (!rows_.step()) return true;
        next_ = rows_.integer(0) + 1;
      } catch (const SqliteDamage&) {
        return false;
      }
      take(rows_);
    }
  }

  bool canReadFrom(std::int64_t row) {
    const StatementScope scope(rows_);
    try {
      rows_.bind(1, row).step();
      return true;
    } catch (const SqliteDamage&) {
      return false;
    }
  }

  /// The smallest row number from which on reading is possible again.
  std::optional<std::int64_t> behindGap() {
    constexpr std::int64_t kFarthest = std::int64_t{1} << 62;
    std::int64_t bad = std::max<std::int64_t>(next_, 0);
    std::int64_t step = 1;
    while (step < kFarthest - bad && !canReadFrom(bad + step)) {
      bad += step;
      step *= 2;
    }
    if (step >= kFarthest - bad) return std::nullopt;
    std::int64_t good = bad + step;
    while (good - bad > 1) {
      const std::int64_t middle = bad + (good - bad) / 2;
      (canReadFrom(middle) ? good : bad) = middle;
    }
    return good;
  }

  SqliteStatement rows_;
  std::int64_t next_;  ///< row to be read next
};

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

  /// The next import, or prune(), drops these recordings.
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

  /// Messages whose channel is lost are lost, too. Of a recording whose row is lost only the source
  /// and the robot are.
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
    SqliteStatement behaviors(to_, "SELECT id FROM behaviors");
    while (behaviors.step()) countBehavior(to_, behaviors.integer(0));
  }

  /// The index of the table still names the messages whose rows are gone.
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

/// PATH.damaged, or PATH.damaged.2 and so on if that file exists.
std::string freePath(const std::string& path) {
  std::string free = path + ".damaged";
  for (int i = 2; fs::exists(free); ++i) free = path + ".damaged." + std::to_string(i);
  return free;
}

/// Puts `copy`, which has no log, in the place of the store, which becomes `aside`. At every moment
/// there is a store at `path`: a recorder would begin an empty one where there is none. The log goes
/// before: it would be taken for that of the copy.
void replaceStore(const std::string& path, const std::string& copy, const std::string& aside) {
  std::error_code has_no_links;
  fs::create_hard_link(path, aside, has_no_links);
  if (has_no_links) fs::copy_file(path, aside);
  for (const char* suffix : {"-wal", "-shm"}) {
    if (fs::exists(path + suffix)) fs::rename(path + suffix, aside + suffix);
  }
  fs::permissions(copy, fs::status(path).permissions());
  requireSyncedName(path);
  fs::rename(copy, path);
  requireSyncedName(path);
}

void removeStore(const std::string& path) {
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(path + suffix, ignored);
}

/// Empty since the last checkpoint.
void removeLog(const std::string& path) {
  for (const char* suffix : {"-wal", "-shm"}) fs::remove(path + suffix);
}

}  // namespace

StoreStats storeStats(const std::string& path) {
  const auto connection = openSqliteStore(path, OpenMode::ReadOnly);
  StoreStats stats;
  stats.file_bytes = fileSize(path) + fileSize(path + "-wal");
  stats.free_bytes =
      number(*connection, "PRAGMA freelist_count") * number(*connection, "PRAGMA page_size");
  stats.recordings = number(*connection, "SELECT count(*) FROM recordings");
  stats.behaviors = number(*connection, "SELECT count(*) FROM behaviors");
  stats.files = number(*connection, "SELECT count(*) FROM files");
  stats.topics = topicStats(*connection);
  for (const auto& topic : stats.topics) stats.messages += topic.messages;
  SqliteStatement span(*connection, "SELECT min(received_ns), max(received_ns) FROM messages");
  span.step();
  if (const auto first = span.optionalInteger(0)) stats.oldest = Stamp{*first};
  if (const auto last = span.optionalInteger(1)) stats.newest = Stamp{*last};
  stats.largest = largestBehaviors(*connection);
  stats.recorder = recorderOf(path);
  return stats;
}

StoreCheck checkStore(const std::string& path, const StoreProgress& progress) {
  const auto connection = openSqliteStore(path, OpenMode::ReadOnly);
  StoreCheck check = Checker(*connection, progress).run();
  for (const std::int64_t recording : unfinishedImports(*connection)) {
    check.dead_imports += isImporting(path, recording) ? 0 : 1;
  }
  return check;
}

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
    removeLog(copy);
    replaceStore(path, copy, repair.damaged_path);
  } catch (const fs::filesystem_error& error) {
    throw StoreError("sqlite:" + path + ": cannot put the repaired store " + copy +
                     " in its place: " + error.code().message());
  }
  return repair;
}

}  // namespace afterglow::replay

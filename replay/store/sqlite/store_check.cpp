#include "replay/store/sqlite/store_check.hpp"

#include <algorithm>

#include "replay/store/sha256.hpp"
#include "replay/store/sqlite/damage_ranges.hpp"
#include "replay/store/sqlite/import_lock.hpp"
#include "replay/store/sqlite/sqlite_message_reader.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"

namespace afterglow::replay {
namespace {

constexpr std::uint64_t kMessagesBetweenReports = 1000;

/// One look at the store; what it cannot read is a problem, too, and the next look is taken.
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
    // In steps of their own: a log of commits that cannot be begun anew would grow all the while.
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

}  // namespace

StoreCheck checkStore(const std::string& path, const StoreProgress& progress) {
  const auto connection = openSqliteStore(path, OpenMode::ReadOnly);
  StoreCheck check = Checker(*connection, progress).run();
  for (const std::int64_t recording : unfinishedImports(*connection)) {
    check.dead_imports += isImporting(path, recording) ? 0 : 1;
  }
  return check;
}

}  // namespace afterglow::replay

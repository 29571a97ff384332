#include "replay/store/sqlite/sqlite_behaviors.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "replay/query/filter.hpp"
#include "replay/store/sqlite/behavior_counts.hpp"
#include "replay/store/sqlite/behavior_query.hpp"
#include "replay/store/sqlite/store_locks.hpp"

namespace afterglow::replay {
namespace {

std::string dump(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::optional<std::int64_t> nanoseconds(const std::optional<Stamp>& stamp) {
  return stamp ? std::optional<std::int64_t>(stamp->ns) : std::nullopt;
}

}  // namespace

SqliteBehaviors::SqliteBehaviors(SqliteConnection& connection, SqliteRecordings& recordings,
                                 SqliteMessages& messages, std::string path, OpenMode mode)
    : connection_(connection),
      recordings_(recordings),
      messages_(messages),
      path_(std::move(path)),
      mode_(mode) {}

// ---------------------------------------------------------------------------------------- writing

std::int64_t SqliteBehaviors::add(const Behavior& behavior) {
  const SqliteLock lock = connection_.lock();
  SqliteTransaction transaction(connection_);
  recordings_.require(behavior.recording);
  const std::string key = behavior.key.empty() ? newKey() : behavior.key;
  SqliteStatement insert(
      connection_,
      "INSERT INTO behaviors (id, key, recording, name, tree_path, parent, "
      "attempt, outcome, begin_ns, wall_begin_ns, robot, parameters, tags, "
      "calibration, topics, snapshot, remarks) VALUES (?1, ?2, ?3, '', '', 0, 1, "
      "'', 0, 0, '', '', '', '', '', '', '')");
  insert.bind(1, behavior.id != 0 ? std::optional(behavior.id) : std::nullopt);
  insert.bind(2, key).bind(3, behavior.recording).run();
  Behavior stored = behavior;
  stored.id = connection_.lastInsertedId();
  update(stored);
  countBehavior(connection_, stored.id);
  transaction.commit();
  return stored.id;
}

void SqliteBehaviors::update(const Behavior& behavior) {
  const SqliteLock lock = connection_.lock();
  checkObjects(behavior, connection_.name());
  const std::string tags = dump(behavior.tags);
  const std::string topics = dump(behavior.topics);
  const std::string remarks = dump(behavior.remarks);
  SqliteTransaction transaction(connection_);
  const auto before = ofId(behavior.id);
  if (!before) connection_.refuse("there is no behavior " + std::to_string(behavior.id));
  SqliteStatement update(connection_,
                         "UPDATE behaviors SET name = ?2, tree_path = ?3, parent = ?4, "
                         "attempt = ?5, outcome = ?6, begin_ns = ?7, end_ns = ?8, robot = ?9, "
                         "parameters = ?10, tags = ?11, calibration = ?12, topics = ?13, "
                         "wall_begin_ns = ?14, snapshot = ?15, remarks = ?16 WHERE id = ?1");
  update.bind(1, behavior.id).bind(2, behavior.name).bind(3, behavior.tree_path);
  update.bind(4, behavior.parent).bind(5, std::int64_t{behavior.attempt});
  update.bind(6, behavior.outcome).bind(7, behavior.begin.ns).bind(8, nanoseconds(behavior.end));
  update.bind(9, behavior.robot).bind(10, behavior.parameters).bind(11, tags);
  update.bind(12, behavior.calibration).bind(13, topics).bind(14, behavior.wall_begin.ns);
  update.bind(15, behavior.snapshot).bind(16, remarks).run();
  const bool is_moved = before->begin != behavior.begin || before->end != behavior.end;
  if (is_moved) countBehavior(connection_, behavior.id);
  transaction.commit();
}

/// The gaps between the other behaviors of its recording, which are read in the order of their
/// begins. The only behavior of a recording covers all that lies before it, too: nothing else leads
/// to messages there.
std::vector<SqliteMessages::Interval> SqliteBehaviors::coveredOnlyBy(
    const Behavior& behavior) const {
  const std::int64_t end_ns = behavior.end ? behavior.end->ns : kEndOfTime.ns;
  SqliteStatement others(connection_,
                         "SELECT begin_ns, coalesce(end_ns, ?3) FROM behaviors "
                         "WHERE recording = ?1 AND id <> ?2 ORDER BY begin_ns");
  others.bind(1, behavior.recording).bind(2, behavior.id).bind(3, kEndOfTime.ns);
  std::vector<SqliteMessages::Interval> uncovered;
  bool is_only = true;
  std::int64_t at_ns = behavior.begin.ns;
  for (; others.step() && at_ns < end_ns; is_only = false) {
    const std::int64_t other_ns = std::min(others.integer(0), end_ns);
    if (at_ns < other_ns) uncovered.push_back({at_ns, other_ns});
    at_ns = std::max(at_ns, others.integer(1));
  }
  if (is_only) at_ns = std::numeric_limits<std::int64_t>::min();
  if (at_ns < end_ns) uncovered.push_back({at_ns, end_ns});
  return uncovered;
}

/// The behavior itself goes last, so that an interrupted removal can be begun again.
void SqliteBehaviors::remove(std::int64_t id) {
  SqliteLock lock = connection_.lock();
  const std::optional<Behavior> removed = ofId(id);
  if (!removed) connection_.refuse("there is no behavior " + std::to_string(id));
  const std::vector<SqliteMessages::Interval> intervals = coveredOnlyBy(*removed);
  lock.unlock();
  for (const auto& interval : intervals) messages_.remove(removed->recording, interval, id);
  lock.lock();
  SqliteTransaction transaction(connection_);
  for (const char* sql :
       {"DELETE FROM behaviors WHERE id = ?1", "DELETE FROM behavior_counts WHERE behavior = ?1"}) {
    SqliteStatement(connection_, sql).bind(1, id).run();
  }
  SqliteStatement(connection_, "UPDATE behaviors SET parent = ?2 WHERE parent = ?1")
      .bind(1, id)
      .bind(2, removed->parent)
      .run();
  transaction.commit();
}

void SqliteBehaviors::endAbandoned() {
  SqliteTransaction transaction(connection_);
  SqliteStatement query(connection_, selectBehaviors("WHERE end_ns IS NULL ORDER BY id"));
  std::vector<Behavior> abandoned;
  while (query.step()) abandoned.push_back(readBehavior(query));
  for (Behavior& behavior : abandoned) {
    SqliteStatement last(connection_,
                         "SELECT max(received_ns) FROM messages WHERE recording = ?1");
    last.bind(1, behavior.recording).step();
    endIncomplete(behavior, last.optionalInteger(0));
    update(behavior);
  }
  transaction.commit();
}

// ---------------------------------------------------------------------------------------- reading

/// A recorder that runs holds the lock.
bool SqliteBehaviors::areOpenOnesAbandoned() const {
  return mode_ == OpenMode::ReadOnly && !recorderOf(path_);
}

std::optional<Behavior> SqliteBehaviors::first(SqliteStatement& query) const {
  const StatementScope scope(query);
  if (!query.step()) return std::nullopt;
  Behavior behavior = readBehavior(query);
  if (isOpen(behavior) && areOpenOnesAbandoned()) behavior.outcome = kIncomplete;
  return behavior;
}

std::optional<Behavior> SqliteBehaviors::ofKey(const std::string& key) const {
  const SqliteLock lock = connection_.lock();
  return first(connection_.prepared(selectBehaviors("WHERE key = ?1")).bind(1, key));
}

std::optional<Behavior> SqliteBehaviors::ofId(std::int64_t id) const {
  const SqliteLock lock = connection_.lock();
  return first(connection_.prepared(selectBehaviors("WHERE id = ?1")).bind(1, id));
}

std::vector<Behavior> SqliteBehaviors::find(const BehaviorFilter& filter,
                                            std::vector<std::string>* steps) const {
  SqliteLock lock = connection_.lock();
  std::vector<Behavior> found = findBehaviors(connection_, filter, areOpenOnesAbandoned(), steps);
  if (!filter.where || found.empty()) return found;
  // What a transaction has written so far is seen by its own connection alone.
  const bool reads_apart = filter.where->root().asksTopics() && !path_.empty() &&
                           !connection_.isInTransaction();
  if (reads_apart) lock.unlock();  // a recorder goes on meanwhile
  filterBehaviors(reads_apart ? nullptr : &connection_, path_, filter, found, steps);
  return found;
}

}  // namespace afterglow::replay

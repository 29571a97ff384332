// SqliteStore: behaviors go in, are found and are removed.
#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "replay/store/sqlite/behavior_counts.hpp"
#include "replay/store/sqlite/behavior_row.hpp"
#include "replay/store/sqlite/sqlite_store.hpp"

namespace afterglow::replay {
namespace {

std::string dump(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

bool isObject(const std::string& text) {
  return nlohmann::json::parse(text, nullptr, false).is_object();
}

std::optional<std::int64_t> nanoseconds(const std::optional<Stamp>& stamp) {
  return stamp ? std::optional<std::int64_t>(stamp->ns) : std::nullopt;
}

}  // namespace

// ---------------------------------------------------------------------------------------- writing

void SqliteStore::checkObjects(const Behavior& behavior) const {
  for (const auto& [what, text] : {std::pair("parameters", &behavior.parameters),
                                   std::pair("calibration", &behavior.calibration),
                                   std::pair("snapshot", &behavior.snapshot)}) {
    if (!isObject(*text)) {
      fail(std::string(what) + " of behavior \"" + behavior.name + "\": no JSON object");
    }
  }
}

std::int64_t SqliteStore::addBehavior(const Behavior& behavior) {
  const Lock lock(mutex_);
  SqliteTransaction transaction(*connection_);
  requireRecording(behavior.recording);
  const std::string key = behavior.key.empty() ? newKey() : behavior.key;
  SqliteStatement insert(
      *connection_,
      "INSERT INTO behaviors (id, key, recording, name, tree_path, parent, "
      "attempt, outcome, begin_ns, wall_begin_ns, robot, parameters, tags, "
      "calibration, topics, snapshot, remarks) VALUES (?1, ?2, ?3, '', '', 0, 1, "
      "'', 0, 0, '', '', '', '', '', '', '')");
  insert.bind(1, behavior.id != 0 ? std::optional(behavior.id) : std::nullopt);
  insert.bind(2, key).bind(3, behavior.recording).run();
  Behavior stored = behavior;
  stored.id = connection_->lastInsertedId();
  updateBehavior(stored);
  countBehavior(*connection_, stored.id);
  field_index_->cut(stored.recording);
  transaction.commit();
  return stored.id;
}

void SqliteStore::updateBehavior(const Behavior& behavior) {
  const Lock lock(mutex_);
  checkObjects(behavior);
  const std::string tags = dump(behavior.tags);
  const std::string topics = dump(behavior.topics);
  const std::string remarks = dump(behavior.remarks);
  SqliteTransaction transaction(*connection_);
  const auto before = this->behavior(behavior.id);
  if (!before) fail("there is no behavior " + std::to_string(behavior.id));
  SqliteStatement update(*connection_,
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
  if (is_moved) {
    countBehavior(*connection_, behavior.id);
    field_index_->cut(before->recording);
  }
  transaction.commit();
}

/// What no other behavior covers is what lies between the others, in the order of their begins.
/// What lies before the last behavior of a recording goes with it: nothing leads there any more.
std::vector<SqliteStore::Interval> SqliteStore::coveredOnlyBy(const Behavior& behavior) const {
  const std::int64_t end_ns = behavior.end ? behavior.end->ns : kForEver_ns;
  SqliteStatement others(*connection_,
                         "SELECT begin_ns, coalesce(end_ns, ?3) FROM behaviors "
                         "WHERE recording = ?1 AND id <> ?2 ORDER BY begin_ns");
  others.bind(1, behavior.recording).bind(2, behavior.id).bind(3, kForEver_ns);
  std::vector<Interval> uncovered;
  bool is_last = true;
  std::int64_t at_ns = behavior.begin.ns;
  for (; others.step() && at_ns < end_ns; is_last = false) {
    const std::int64_t other_ns = std::min(others.integer(0), end_ns);
    if (at_ns < other_ns) uncovered.push_back({at_ns, other_ns});
    at_ns = std::max(at_ns, others.integer(1));
  }
  if (is_last) at_ns = std::numeric_limits<std::int64_t>::min();
  if (at_ns < end_ns) uncovered.push_back({at_ns, end_ns});
  return uncovered;
}

/// In slices of a transaction each, so that a recorder need not wait for gigabytes to be removed;
/// the behavior itself last, so that an interrupted removal can be begun again.
void SqliteStore::removeBehavior(std::int64_t id) {
  Lock lock(mutex_);
  const std::optional<Behavior> removed = behavior(id);
  if (!removed) fail("there is no behavior " + std::to_string(id));
  const std::vector<Interval> intervals = coveredOnlyBy(*removed);
  lock.unlock();
  for (const Interval& interval : intervals) removeMessages(*removed, interval);
  lock.lock();
  SqliteTransaction transaction(*connection_);
  for (const char* sql :
       {"DELETE FROM behaviors WHERE id = ?1", "DELETE FROM behavior_counts WHERE behavior = ?1"}) {
    SqliteStatement(*connection_, sql).bind(1, id).run();
  }
  SqliteStatement(*connection_, "UPDATE behaviors SET parent = ?2 WHERE parent = ?1")
      .bind(1, id)
      .bind(2, removed->parent)
      .run();
  transaction.commit();
}

/// Nobody but a recorder leaves behaviors open, and this one is the only recorder.
void SqliteStore::endAbandonedBehaviors() {
  SqliteTransaction transaction(*connection_);
  SqliteStatement query(*connection_,
                        std::string(kBehaviorColumns) + "WHERE end_ns IS NULL ORDER BY id");
  std::vector<Behavior> abandoned;
  while (query.step()) abandoned.push_back(readBehavior(query));
  for (Behavior& behavior : abandoned) {
    SqliteStatement last(*connection_,
                         "SELECT max(received_ns) FROM messages WHERE recording = ?1");
    last.bind(1, behavior.recording).step();
    const auto last_ns = last.optionalInteger(0);
    behavior.end = Stamp{std::max(behavior.begin.ns, last_ns ? *last_ns + 1 : behavior.begin.ns)};
    behavior.outcome = kIncomplete;
    behavior.remarks.emplace_back("Its recorder died; it ends with the last message stored.");
    updateBehavior(behavior);
  }
  transaction.commit();
}

// ---------------------------------------------------------------------------------------- reading

/// A recorder that runs holds the lock.
bool SqliteStore::areOpenOnesAbandoned() const {
  return mode_ == OpenMode::ReadOnly && !recorderOf(path_);
}

std::optional<Behavior> SqliteStore::behaviorOf(SqliteStatement& query) const {
  const StatementScope scope(query);
  if (!query.step()) return std::nullopt;
  Behavior behavior = readBehavior(query);
  if (isOpen(behavior) && areOpenOnesAbandoned()) behavior.outcome = kIncomplete;
  return behavior;
}

std::optional<Behavior> SqliteStore::behaviorOfKey(const std::string& key) const {
  const Lock lock(mutex_);
  return behaviorOf(
      connection_->prepared(std::string(kBehaviorColumns) + "WHERE key = ?1").bind(1, key));
}

std::optional<Behavior> SqliteStore::behavior(std::int64_t id) const {
  const Lock lock(mutex_);
  return behaviorOf(
      connection_->prepared(std::string(kBehaviorColumns) + "WHERE id = ?1").bind(1, id));
}

}  // namespace afterglow::replay

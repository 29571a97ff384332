// SqliteStore: behaviors go in, are found and are removed.
#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "replay/store/behavior_counts.hpp"
#include "replay/store/sqlite_store.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kBehaviorColumns =
    "SELECT id, recording, name, tree_path, parent, attempt, outcome, begin_ns, end_ns, robot, "
    "parameters, tags, calibration, topics, key, wall_begin_ns, snapshot, remarks FROM behaviors "
    "b ";
constexpr std::int64_t kForEver_ns = std::numeric_limits<std::int64_t>::max();

std::string dump(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::vector<std::string> parseStrings(const std::string& array) {
  std::vector<std::string> strings;
  const auto json = nlohmann::json::parse(array, nullptr, false);
  for (const auto& element : json) {
    if (element.is_string()) strings.push_back(element.get<std::string>());
  }
  return strings;
}

bool isJsonObject(const std::string& text) {
  return nlohmann::json::parse(text, nullptr, false).is_object();
}

Behavior readBehavior(const SqliteStatement& row) {
  Behavior behavior;
  behavior.id = row.integer(0);
  behavior.recording = row.integer(1);
  behavior.name = row.text(2);
  behavior.tree_path = row.text(3);
  behavior.parent = row.integer(4);
  behavior.attempt = static_cast<int>(row.integer(5));
  behavior.outcome = row.text(6);
  behavior.begin = {row.integer(7)};
  if (const auto end_ns = row.optionalInteger(8)) behavior.end = Stamp{*end_ns};
  behavior.robot = row.text(9);
  behavior.parameters = row.text(10);
  behavior.tags = parseStrings(row.text(11));
  behavior.calibration = row.text(12);
  behavior.topics = parseStrings(row.text(13));
  behavior.key = row.text(14);
  behavior.wall_begin = {row.integer(15)};
  behavior.snapshot = row.text(16);
  behavior.remarks = parseStrings(row.text(17));
  return behavior;
}

bool isOpen(const Behavior& behavior) { return !behavior.end && behavior.outcome.empty(); }

std::optional<std::int64_t> nanoseconds(const std::optional<Stamp>& stamp) {
  return stamp ? std::optional<std::int64_t>(stamp->ns) : std::nullopt;
}

/// Only what is asked for is in it, so that an index can serve it.
std::string conditionsOf(const BehaviorFilter& filter, bool open_are_incomplete) {
  std::string sql = "WHERE 1";
  if (filter.name) sql += " AND name = ?1";
  if (filter.outcome) {
    const bool with_abandoned = open_are_incomplete && *filter.outcome == kIncomplete;
    sql += with_abandoned ? " AND (outcome = ?2 OR (outcome = '' AND end_ns IS NULL))"
                          : " AND outcome = ?2";
  }
  if (filter.since) {
    sql +=
        " AND ?3 < coalesce(end_ns, (SELECT max(received_ns) + 1 FROM messages m "
        "WHERE m.recording = b.recording), begin_ns + 1)";
  }
  if (filter.until) sql += " AND begin_ns < ?4";
  if (filter.topic) {
    sql +=
        " AND ?5 IN (SELECT value FROM json_each(b.topics)) AND EXISTS (SELECT 1 "
        "FROM behavior_counts n JOIN channels c ON c.id = n.channel "
        "WHERE n.behavior = b.id AND c.topic = ?5)";
  }
  if (filter.robot) sql += " AND robot = ?6";
  if (filter.tag) sql += " AND ?7 IN (SELECT value FROM json_each(b.tags))";
  return sql;
}

void bindFilter(SqliteStatement& query, const BehaviorFilter& filter) {
  if (filter.name) query.bind(1, *filter.name);
  if (filter.outcome) query.bind(2, *filter.outcome);
  if (filter.since) query.bind(3, filter.since->ns);
  if (filter.until) query.bind(4, filter.until->ns);
  if (filter.topic) query.bind(5, *filter.topic);
  if (filter.robot) query.bind(6, *filter.robot);
  if (filter.tag) query.bind(7, *filter.tag);
}

}  // namespace

// ---------------------------------------------------------------------------------------- writing

void SqliteStore::checkObjects(const Behavior& behavior) const {
  for (const auto& [what, text] : {std::pair("parameters", &behavior.parameters),
                                   std::pair("calibration", &behavior.calibration),
                                   std::pair("snapshot", &behavior.snapshot)}) {
    if (!isJsonObject(*text)) {
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
  if (is_moved) countBehavior(*connection_, behavior.id);
  transaction.commit();
}

/// What no other behavior covers is what lies between the others, in the order of their begins.
void SqliteStore::removeBehavior(std::int64_t id) {
  const Lock lock(mutex_);
  SqliteTransaction transaction(*connection_);
  const std::optional<Behavior> removed = behavior(id);
  if (!removed) fail("there is no behavior " + std::to_string(id));
  for (const char* sql :
       {"DELETE FROM behaviors WHERE id = ?1", "DELETE FROM behavior_counts WHERE behavior = ?1"}) {
    SqliteStatement(*connection_, sql).bind(1, id).run();
  }
  SqliteStatement(*connection_, "UPDATE behaviors SET parent = ?2 WHERE parent = ?1")
      .bind(1, id)
      .bind(2, removed->parent)
      .run();
  const std::int64_t end_ns = removed->end ? removed->end->ns : kForEver_ns;
  std::int64_t uncovered_ns = removed->begin.ns;
  SqliteStatement others(*connection_,
                         "SELECT begin_ns, coalesce(end_ns, ?4) FROM behaviors "
                         "WHERE recording = ?1 AND begin_ns < ?3 AND coalesce(end_ns, ?4) > ?2 "
                         "ORDER BY begin_ns");
  others.bind(1, removed->recording).bind(2, uncovered_ns).bind(3, end_ns).bind(4, kForEver_ns);
  while (others.step()) {
    removeMessages(removed->recording, uncovered_ns, others.integer(0));
    uncovered_ns = std::max(uncovered_ns, others.integer(1));
  }
  removeMessages(removed->recording, uncovered_ns, end_ns);
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

std::vector<Behavior> SqliteStore::behaviors(const BehaviorFilter& filter) const {
  const Lock lock(mutex_);
  const bool are_abandoned = areOpenOnesAbandoned();
  std::string sql =
      kBehaviorColumns + conditionsOf(filter, are_abandoned) + " ORDER BY begin_ns DESC, id DESC";
  if (filter.limit && !filter.where) sql += " LIMIT " + std::to_string(*filter.limit);
  SqliteStatement query(*connection_, sql);
  bindFilter(query, filter);
  std::vector<Behavior> found;
  while (query.step()) {
    found.push_back(readBehavior(query));
    if (are_abandoned && isOpen(found.back())) found.back().outcome = kIncomplete;
  }
  return found;
}

std::vector<std::string> SqliteStore::explain(const BehaviorFilter&) const { return {}; }

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

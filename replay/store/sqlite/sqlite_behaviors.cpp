#include "replay/store/sqlite/sqlite_behaviors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "replay/messages/foreign_json.hpp"
#include "replay/query/filter.hpp"
#include "replay/store/sqlite/behavior_counts.hpp"
#include "replay/store/sqlite/sqlite_cursor.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"
#include "replay/store/sqlite/store_files.hpp"

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

namespace {

std::vector<std::string> parseStrings(const std::string& array) {
  std::vector<std::string> strings;
  if (array == "[]") return strings;
  const auto parsed = parseForeignJson(array);
  for (const auto& element : parsed) {
    if (element.is_string()) strings.push_back(element.get<std::string>());
  }
  return strings;
}

/// Has only the conditions that are asked for, so that an index of the table can serve them.
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
  sql += " ORDER BY begin_ns DESC, id DESC";
  if (filter.limit && !filter.where) sql += " LIMIT " + std::to_string(*filter.limit);
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

/// Equalities of `where` on columns that have an index become members, which SQLite looks up.
BehaviorFilter narrowed(BehaviorFilter filter) {
  if (!filter.where) return filter;
  const Condition& root = filter.where->root();
  const std::vector<Condition> parts =
      root.kind == Condition::Kind::All ? root.parts : std::vector<Condition>{root};
  for (const Condition& part : parts) {
    const bool is_equality = part.kind == Condition::Kind::Value &&
                             part.op == Condition::Op::Equal && part.operand.is_string();
    if (!is_equality) continue;
    for (const auto& [name, member] :
         {std::pair("name", &filter.name), std::pair("outcome", &filter.outcome),
          std::pair("robot", &filter.robot)}) {
      if (part.path == name && !*member) *member = part.operand.get<std::string>();
    }
  }
  return filter;
}

/// Returns how SQLite finds the rows: its own plan, in words.
std::string accessOf(SqliteConnection& connection, const std::string& sql) {
  SqliteStatement plan(connection, "EXPLAIN QUERY PLAN " + sql);
  std::string access = "all";
  while (plan.step()) {
    const std::string step = plan.text(3);
    const std::string index = " USING INDEX behaviors_by_";
    const auto at = step.find(index);
    if (at == std::string::npos) continue;
    const std::string name = step.substr(at + index.size());
    access = step.rfind("SEARCH", 0) == 0 ? "index by " + name.substr(0, name.find(' '))
                                          : "all, newest first";
  }
  return access;
}

}  // namespace

std::string selectBehaviors(const std::string& conditions) {
  return "SELECT id, recording, name, tree_path, parent, attempt, outcome, begin_ns, end_ns, "
         "robot, parameters, tags, calibration, topics, key, wall_begin_ns, snapshot, remarks "
         "FROM behaviors b " +
         conditions;
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

std::vector<Behavior> findBehaviors(SqliteConnection& connection, const BehaviorFilter& asked,
                                    bool open_are_incomplete, std::vector<std::string>* steps) {
  const BehaviorFilter filter = narrowed(asked);
  const std::string sql = selectBehaviors(conditionsOf(filter, open_are_incomplete));
  SqliteStatement query(connection, sql);
  bindFilter(query, filter);
  std::vector<Behavior> found;
  while (query.step()) {
    found.push_back(readBehavior(query));
    if (open_are_incomplete && isOpen(found.back())) found.back().outcome = kIncomplete;
  }
  if (steps) {
    steps->push_back("behaviors: " + accessOf(connection, sql) + ", " +
                     std::to_string(found.size()) + " of " +
                     std::to_string(connection.integer("SELECT count(*) FROM behaviors")));
  }
  return found;
}

namespace {

constexpr std::size_t kMostThreads = 8;
/// The behaviors that are looked at with a limit before it is known whether more are needed.
constexpr std::size_t kRound = 64;

/// Says of behaviors whether they match; of one thread.
class BehaviorMatcher {
 public:
  /// Matches with a connection of its own if `connection` is null.
  BehaviorMatcher(SqliteConnection* connection, const std::string& path, const Filter& filter)
      : own_(connection ? nullptr : openSqliteStore(path, OpenMode::ReadOnly)),
        connection_(connection ? *connection : *own_),
        filter_(filter) {}

  bool matches(const Behavior& behavior) {
    return filter_.matches(behavior, [&](const std::string& topic, const Condition& condition) {
      // It does not own the condition, which the filter keeps.
      const std::shared_ptr<const Condition> where(std::shared_ptr<void>(), &condition);
      SqliteCursor cursor(connection_, behavior, {{topic}}, where, 1);
      const bool is_any = cursor.next().has_value();
      looked_ += cursor.looked();
      return is_any;
    });
  }
  std::uint64_t looked() const { return looked_; }  ///< number of messages that were looked at

 private:
  std::unique_ptr<SqliteConnection> own_;
  SqliteConnection& connection_;
  const Filter& filter_;
  std::uint64_t looked_ = 0;
};

/// Returns which of the behaviors match, each looked at by the next matcher that is free.
std::vector<char> matchesOf(std::vector<BehaviorMatcher>& matchers, const Behavior* behaviors,
                            std::size_t count) {
  std::vector<char> matches(count);
  std::atomic<std::size_t> next{0};
  const auto work = [&](BehaviorMatcher& matcher) {
    for (std::size_t i = next++; i < count; i = next++) matches[i] = matcher.matches(behaviors[i]);
  };
  std::vector<std::future<void>> others;
  for (std::size_t i = 1; i < matchers.size(); ++i) {
    others.push_back(std::async(std::launch::async, work, std::ref(matchers[i])));
  }
  work(matchers.front());
  for (std::future<void>& other : others) other.get();
  return matches;
}

std::vector<BehaviorMatcher> makeMatchers(SqliteConnection* connection, const std::string& path,
                                          const Filter& filter, std::size_t behaviors) {
  const std::size_t processors = std::max(1u, std::thread::hardware_concurrency());
  const std::size_t count = connection ? 1 : std::min({behaviors, kMostThreads, processors});
  std::vector<BehaviorMatcher> matchers;
  for (std::size_t i = 0; i < count; ++i) {
    matchers.emplace_back(connection, path, filter);
  }
  return matchers;
}

}  // namespace

void filterBehaviors(SqliteConnection* connection, const std::string& path,
                     const BehaviorFilter& filter, std::vector<Behavior>& found,
                     std::vector<std::string>* steps) {
  auto matchers = makeMatchers(connection, path, *filter.where, found.size());
  const std::size_t most = filter.limit.value_or(found.size());
  std::size_t looked = 0, kept = 0;
  while (looked < found.size() && kept < most) {
    const std::size_t rest = found.size() - looked;
    const std::size_t count = filter.limit ? std::min(rest, kRound) : rest;
    const std::vector<char> matches = matchesOf(matchers, &found[looked], count);
    for (std::size_t i = 0; i < count && kept < most; ++i, ++looked) {
      if (!matches[i]) continue;
      if (kept != looked) found[kept] = std::move(found[looked]);
      ++kept;
    }
  }
  found.resize(kept);
  if (!steps) return;
  std::uint64_t messages = 0;
  for (const BehaviorMatcher& matcher : matchers) messages += matcher.looked();
  steps->push_back(
      fmt::format("filter: {} of {} match; messages read: {}", kept, looked, messages));
}

}  // namespace afterglow::replay

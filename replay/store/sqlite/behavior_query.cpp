#include "replay/store/sqlite/behavior_query.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "replay/messages/foreign_json.hpp"
#include "replay/query/filter.hpp"
#include "replay/store/sqlite/sqlite_cursor.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"

namespace afterglow::replay {
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

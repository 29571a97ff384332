// SqliteStore: finds behaviors. Indexes narrow, Filter judges.
#include <algorithm>

#include "replay/store/sqlite/behavior_row.hpp"
#include "replay/store/sqlite/sqlite_store.hpp"
#include "replay/store/sqlite/sqlite_where.hpp"

namespace afterglow::replay {
namespace {

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

/// What the filter says must be so of columns that have an index is asked of SQLite.
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

}  // namespace

std::string SqliteStore::candidatesSql(const BehaviorFilter& filter) const {
  std::string sql = kBehaviorColumns + conditionsOf(filter, areOpenOnesAbandoned()) +
                    " ORDER BY begin_ns DESC, id DESC";
  if (filter.limit && !filter.where) sql += " LIMIT " + std::to_string(*filter.limit);
  return sql;
}

std::vector<Behavior> SqliteStore::candidates(const BehaviorFilter& filter) const {
  const bool are_abandoned = areOpenOnesAbandoned();
  SqliteStatement query(*connection_, candidatesSql(filter));
  bindFilter(query, filter);
  std::vector<Behavior> found;
  while (query.step()) {
    found.push_back(readBehavior(query));
    if (are_abandoned && isOpen(found.back())) found.back().outcome = kIncomplete;
  }
  return found;
}

/// How SQLite comes by the candidates: its own plan, in words.
std::string SqliteStore::accessOf(const BehaviorFilter& filter) const {
  SqliteStatement plan(*connection_, "EXPLAIN QUERY PLAN " + candidatesSql(filter));
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

std::vector<Behavior> SqliteStore::find(const BehaviorFilter& asked,
                                        std::vector<std::string>* steps) const {
  const Lock lock(mutex_);
  const BehaviorFilter filter = narrowed(asked);
  std::vector<Behavior> found = candidates(filter);
  if (steps) {
    steps->push_back("behaviors: " + accessOf(filter) + ", " + std::to_string(found.size()) +
                     " of " +
                     std::to_string(connection_->integer("SELECT count(*) FROM behaviors")));
  }
  if (!filter.where || found.empty()) return found;
  std::int64_t end_ns = found.front().begin.ns;
  for (const Behavior& behavior : found) {
    end_ns = std::max(end_ns, behavior.end ? behavior.end->ns : kForEver_ns);
  }
  SqliteWhere where(*connection_, *field_index_, *filter.where, found.back().begin.ns, end_ns);
  std::size_t looked_at = 0, matching = 0;
  for (Behavior& behavior : found) {
    if (filter.limit && matching == *filter.limit) break;
    ++looked_at;
    if (!where.matches(behavior)) continue;
    if (&found[matching] != &behavior) found[matching] = std::move(behavior);
    ++matching;
  }
  found.resize(matching);
  if (steps) {
    steps->push_back("filter: " + std::to_string(matching) + " of " + std::to_string(looked_at) +
                     " match");
    for (std::string& line : where.explain()) steps->push_back(std::move(line));
  }
  return found;
}

std::vector<Behavior> SqliteStore::behaviors(const BehaviorFilter& filter) const {
  return find(filter, nullptr);
}

std::vector<std::string> SqliteStore::explain(const BehaviorFilter& filter) const {
  std::vector<std::string> steps;
  find(filter, &steps);
  return steps;
}

}  // namespace afterglow::replay

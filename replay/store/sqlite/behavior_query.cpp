#include "replay/store/sqlite/behavior_query.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "replay/messages/foreign_json.hpp"
#include "replay/store/sqlite/sqlite_cursor.hpp"

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

/// 1,234,567
std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t at = text.size(); at > 3;) {
    at -= 3;
    text.insert(at, ",");
  }
  return text;
}

/// Which behaviors match a filter: their own fields, and whether one of their messages matches.
class BehaviorMatcher {
 public:
  /// For behaviors in [begin, end). All must outlive it.
  BehaviorMatcher(SqliteConnection& connection, SqliteFieldIndex& index, const Filter& filter,
                  std::int64_t begin_ns, std::int64_t end_ns)
      : connection_(connection),
        index_(index),
        filter_(filter),
        begin_ns_(begin_ns),
        end_ns_(end_ns),
        reader_(connection),
        scan_(connection,
              "SELECT received_ns, sequence, id FROM messages INDEXED BY messages_in_order "
              "WHERE recording = ?1 AND received_ns >= ?2 AND received_ns <= ?3 "
              "AND +channel = ?4 ORDER BY received_ns, sequence") {}

  bool matches(const Behavior& behavior) {
    return filter_.matches(behavior, [&](const std::string& topic, const Condition& condition) {
      return anyMessage(behavior, topic, condition);
    });
  }

  /// A line for each topic that was asked for: how many blocks the index ruled out, was sure of,
  /// and left to be read.
  std::vector<std::string> explain() const {
    std::vector<std::string> lines;
    for (const auto& [topic, count] : counts_) {
      lines.push_back("topic " + topic + ": " + grouped(count.blocks) + " blocks, " +
                      grouped(count.ruled_out) + " ruled out by index, " + grouped(count.sure) +
                      " sure, " + grouped(count.read) + " read (" + grouped(count.messages) +
                      " messages)");
    }
    return lines;
  }

 private:
  struct Count {
    std::uint64_t blocks = 0, ruled_out = 0, sure = 0, read = 0, messages = 0;
  };
  /// Messages of one channel, with both ends of the interval.
  struct Stretch {
    std::int64_t channel, first_ns, last_ns;
  };

  std::vector<Stretch> stretchesOf(const Behavior& behavior, const std::string& topic) {
    SqliteStatement& query = connection_.prepared(
        "SELECT channel, first_ns, last_ns FROM behavior_counts JOIN channels ON id = channel "
        "WHERE behavior = ?1 AND topic = ?2");
    const StatementScope scope(query);
    query.bind(1, behavior.id).bind(2, topic);
    std::vector<Stretch> found;
    while (query.step()) found.push_back({query.integer(0), query.integer(1), query.integer(2)});
    return found;
  }

  const ChannelAnswers& answersOf(std::int64_t channel, const Condition& condition) {
    const std::pair key(channel, &condition);
    const auto known = answers_.find(key);
    if (known != answers_.end()) return known->second;
    ChannelAnswers answers(connection_, index_, channel, condition, begin_ns_, end_ns_);
    return answers_.emplace(key, std::move(answers)).first->second;
  }

  bool anyMessage(const Behavior& behavior, const std::string& topic, const Condition& condition) {
    Count& count = counts_[topic];
    const std::vector<Stretch> stretches = stretchesOf(behavior, topic);
    const bool asks_for_any = condition.kind == Condition::Kind::All && condition.parts.empty();
    if (asks_for_any) return !stretches.empty();
    std::vector<std::pair<const ChannelAnswers*, Stretch>> to_read;
    for (const Stretch& stretch : stretches) {
      const ChannelAnswers& answers = answersOf(stretch.channel, condition);
      const auto open = openStretches(answers, stretch, count);
      if (!open) return true;
      for (const Stretch& part : *open) to_read.emplace_back(&answers, part);
    }
    return std::any_of(to_read.begin(), to_read.end(), [&](const auto& part) {
      return readAny(behavior.recording, part.second, *part.first, count);
    });
  }

  /// The parts that must be read; empty: a message matches surely.
  std::optional<std::vector<Stretch>> openStretches(const ChannelAnswers& answers,
                                                    const Stretch& stretch, Count& count) const {
    std::vector<Stretch> open;
    bool is_sure = false, has_blocks = false;
    answers.forBlocks(stretch.first_ns, stretch.last_ns + 1, [&](const auto& block) {
      has_blocks = true;
      ++count.blocks;
      const bool is_inside =
          block.first_ns >= stretch.first_ns && block.last_ns <= stretch.last_ns;
      if (block.answer == Answer::None) {
        ++count.ruled_out;
      } else if (is_inside && block.answer != Answer::Maybe) {
        ++count.sure;
        is_sure = true;
      } else {
        const std::int64_t first_ns = std::max(block.first_ns, stretch.first_ns);
        open.push_back({stretch.channel,
                        open.empty() ? first_ns : std::max(first_ns, open.back().last_ns),
                        std::min(block.last_ns, stretch.last_ns)});
      }
    });
    if (is_sure) return std::nullopt;
    if (!has_blocks) open.push_back(stretch);  // no field of the type is understood
    return open;
  }

  /// Reads messages until one matches.
  bool readAny(std::int64_t recording, const Stretch& stretch, const ChannelAnswers& answers,
               Count& count) {
    ++count.read;
    const StatementScope scope(scan_);
    scan_.bind(1, recording).bind(2, stretch.first_ns).bind(3, stretch.last_ns);
    scan_.bind(4, stretch.channel);
    while (scan_.step()) {
      ++count.messages;
      SqliteMessageReader::Contents contents = reader_.read(scan_.integer(2));
      if (!contents.problem.empty()) continue;
      const Message message{stretch.channel, Stamp{scan_.integer(0)},
                            static_cast<std::uint64_t>(scan_.integer(1)), contents.header_stamp,
                            std::move(contents.bytes)};
      if (answers.matches(message)) return true;
    }
    return false;
  }

  SqliteConnection& connection_;
  SqliteFieldIndex& index_;
  const Filter& filter_;
  std::int64_t begin_ns_, end_ns_;
  SqliteMessageReader reader_;
  SqliteStatement scan_;
  std::map<std::pair<std::int64_t, const Condition*>, ChannelAnswers> answers_;
  std::map<std::string, Count> counts_;  ///< by topic
};

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

/// How SQLite finds the rows: its own plan, in words.
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

/// Leaves those that match `filter.where`.
void filterBehaviors(SqliteConnection& connection, SqliteFieldIndex& index,
                     const BehaviorFilter& filter, std::vector<Behavior>& found,
                     std::vector<std::string>* steps) {
  std::int64_t end_ns = found.front().begin.ns;
  for (const Behavior& behavior : found) {
    end_ns = std::max(end_ns, behavior.end ? behavior.end->ns : kEndOfTime.ns);
  }
  BehaviorMatcher matcher(connection, index, *filter.where, found.back().begin.ns, end_ns);
  std::size_t looked_at = 0, matching = 0;
  for (Behavior& behavior : found) {
    if (filter.limit && matching == *filter.limit) break;
    ++looked_at;
    if (!matcher.matches(behavior)) continue;
    if (&found[matching] != &behavior) found[matching] = std::move(behavior);
    ++matching;
  }
  found.resize(matching);
  if (!steps) return;
  steps->push_back("filter: " + std::to_string(matching) + " of " + std::to_string(looked_at) +
                   " match");
  for (std::string& line : matcher.explain()) steps->push_back(std::move(line));
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

std::vector<Behavior> findBehaviors(SqliteConnection& connection, SqliteFieldIndex& index,
                                    const BehaviorFilter& asked, bool open_are_incomplete,
                                    std::vector<std::string>* steps) {
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
  if (filter.where && !found.empty()) filterBehaviors(connection, index, filter, found, steps);
  return found;
}

}  // namespace afterglow::replay

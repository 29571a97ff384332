#include "replay/store/sqlite/sqlite_where.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

/// 1,234,567
std::string grouped(std::uint64_t number) {
  std::string text = std::to_string(number);
  for (std::size_t at = text.size(); at > 3;) {
    at -= 3;
    text.insert(at, ",");
  }
  return text;
}

}  // namespace

SqliteWhere::SqliteWhere(SqliteConnection& connection, SqliteFieldIndex& index,
                         const Filter& filter, std::int64_t begin_ns, std::int64_t end_ns)
    : connection_(connection),
      index_(index),
      filter_(filter),
      begin_ns_(begin_ns),
      end_ns_(end_ns),
      reader_(connection),
      scan_(connection,
            "SELECT received_ns, sequence, id FROM messages INDEXED BY messages_in_order "
            "WHERE recording = ?1 AND received_ns >= ?2 AND received_ns <= ?3 AND +channel = ?4 "
            "ORDER BY received_ns, sequence") {}

bool SqliteWhere::matches(const Behavior& behavior) {
  return filter_.matches(behavior, [&](const std::string& topic, const Condition& condition) {
    return anyMessage(behavior, topic, condition);
  });
}

std::vector<SqliteWhere::Part> SqliteWhere::partsOf(const Behavior& behavior,
                                                    const std::string& topic) {
  SqliteStatement& query = connection_.prepared(
      "SELECT channel, first_ns, last_ns FROM behavior_counts JOIN channels ON id = channel "
      "WHERE behavior = ?1 AND topic = ?2");
  const StatementScope scope(query);
  query.bind(1, behavior.id).bind(2, topic);
  std::vector<Part> parts;
  while (query.step()) parts.push_back({query.integer(0), query.integer(1), query.integer(2)});
  return parts;
}

const ChannelAnswers& SqliteWhere::answersOf(std::int64_t channel, const Condition& condition) {
  const std::pair key(channel, &condition);
  const auto known = answers_.find(key);
  if (known != answers_.end()) return known->second;
  ChannelAnswers answers(connection_, index_, channel, condition, begin_ns_, end_ns_);
  return answers_.emplace(key, std::move(answers)).first->second;
}

bool SqliteWhere::anyMessage(const Behavior& behavior, const std::string& topic,
                             const Condition& condition) {
  Count& count = counts_[topic];
  const std::vector<Part> parts = partsOf(behavior, topic);
  const bool asks_for_any = condition.kind == Condition::Kind::All && condition.parts.empty();
  if (asks_for_any) return !parts.empty();
  std::vector<std::pair<const ChannelAnswers*, Part>> to_read;
  for (const Part& part : parts) {
    const ChannelAnswers& answers = answersOf(part.channel, condition);
    const auto stretches = openStretches(answers, part, count);
    if (!stretches) return true;
    for (const Part& stretch : *stretches) to_read.emplace_back(&answers, stretch);
  }
  return std::any_of(to_read.begin(), to_read.end(), [&](const auto& stretch) {
    return anyOf(behavior.recording, stretch.second, *stretch.first, count);
  });
}

std::optional<std::vector<SqliteWhere::Part>> SqliteWhere::openStretches(
    const ChannelAnswers& answers, const Part& part, Count& count) const {
  std::vector<Part> open;
  bool is_sure = false, has_blocks = false;
  answers.forBlocks(part.first_ns, part.last_ns + 1, [&](const ChannelAnswers::Block& block) {
    has_blocks = true;
    ++count.blocks;
    if (block.answer == Answer::None) {
      ++count.ruled_out;
      return;
    }
    const bool is_inside = block.first_ns >= part.first_ns && block.last_ns <= part.last_ns;
    if (is_inside && block.answer != Answer::Maybe) {
      ++count.sure;
      is_sure = true;
      return;
    }
    const std::int64_t first_ns = std::max(block.first_ns, part.first_ns);
    const std::int64_t read_ns = open.empty() ? first_ns : std::max(first_ns, open.back().last_ns);
    open.push_back({part.channel, read_ns, std::min(block.last_ns, part.last_ns)});
  });
  if (is_sure) return std::nullopt;
  if (!has_blocks) return std::vector<Part>{part};  // of a type without fields that are understood
  return open;
}

bool SqliteWhere::anyOf(std::int64_t recording, const Part& stretch, const ChannelAnswers& answers,
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

std::vector<std::string> SqliteWhere::explain() const {
  std::vector<std::string> lines;
  for (const auto& [topic, count] : counts_) {
    lines.push_back("topic " + topic + ": " + grouped(count.blocks) + " blocks, " +
                    grouped(count.ruled_out) + " ruled out by index, " + grouped(count.sure) +
                    " sure, " + grouped(count.read) + " read (" + grouped(count.messages) +
                    " messages)");
  }
  return lines;
}

}  // namespace afterglow::replay

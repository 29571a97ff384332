#include "replay/store/sqlite/channel_answers.hpp"

#include <algorithm>

namespace afterglow::replay {
namespace {

std::string_view viewOf(const SqliteStatement& row, int column) {
  return {reinterpret_cast<const char*>(row.data(column)), row.size(column)};
}

bool asksForNothing(const Condition& condition) {
  return condition.kind == Condition::Kind::All && condition.parts.empty();
}

}  // namespace

ChannelAnswers::ChannelAnswers(SqliteConnection& connection, SqliteFieldIndex& index,
                               std::int64_t channel, const Condition& condition,
                               std::int64_t begin_ns, std::int64_t end_ns)
    : condition_(condition), slots_(index.slotsOf(channel)) {
  if (!slots_) return;
  FieldQuestion question(*slots_, condition);
  SqliteStatement& rows = connection.prepared(
      "SELECT first_ns, last_ns, is_whole, ranges, bloom FROM field_blocks "
      "WHERE channel = ?1 AND first_ns < ?3 AND last_ns >= ?2 ORDER BY first_ns");
  const StatementScope scope(rows);
  rows.bind(1, channel).bind(2, begin_ns).bind(3, end_ns);
  while (rows.step()) {
    Answer answer = question.ask(viewOf(rows, 3), {});
    if (answer == Answer::Maybe) answer = question.ask(viewOf(rows, 3), viewOf(rows, 4));
    const bool is_whole = rows.integer(2) != 0;
    if (!is_whole && answer != Answer::None) answer = Answer::Maybe;
    blocks_.push_back({rows.integer(0), rows.integer(1), answer});
    latest_.push_back(std::max(blocks_.back().last_ns,
                               latest_.empty() ? blocks_.back().last_ns : latest_.back()));
  }
}

std::size_t ChannelAnswers::firstBlock(std::int64_t begin_ns) const {
  const auto first = std::lower_bound(latest_.begin(), latest_.end(), begin_ns);
  return static_cast<std::size_t>(first - latest_.begin());
}

bool ChannelAnswers::isRuledOut(Stamp received) const {
  bool has_block = false, is_ruled_out = true;
  forBlocks(received.ns, received.ns + 1, [&](const Block& block) {
    has_block = true;
    is_ruled_out = is_ruled_out && block.answer == Answer::None;
  });
  return has_block && is_ruled_out;
}

bool ChannelAnswers::matches(const Message& message) const {
  if (asksForNothing(condition_)) return true;
  if (!slots_) return false;
  try {
    return condition_.matches(messageDocument(slots_->schema(), message));
  } catch (const MessageError&) {
    return false;
  }
}

}  // namespace afterglow::replay

#include "replay/store/sqlite/sqlite_field_index.hpp"

#include <algorithm>
#include <random>

namespace afterglow::replay {
namespace {

/// Tells blocks apart that begin with messages of the same time.
std::int64_t newId() {
  thread_local std::mt19937_64 random{std::random_device{}()};
  return static_cast<std::int64_t>(random() >> 1);
}

std::string_view viewOf(const SqliteStatement& row, int column) {
  return {reinterpret_cast<const char*>(row.data(column)), row.size(column)};
}

bool asksForNothing(const Condition& condition) {
  return condition.kind == Condition::Kind::All && condition.parts.empty();
}

}  // namespace

std::shared_ptr<const FieldSlots> SqliteFieldIndex::slotsOf(std::int64_t channel) {
  SqliteStatement& query =
      connection_.prepared("SELECT definition FROM channels WHERE id = ?1").bind(1, channel);
  const StatementScope scope(query);
  if (!query.step()) return nullptr;
  const std::int64_t definition = query.integer(0);
  const auto known = slots_.find(definition);
  if (known != slots_.end()) return known->second;
  SqliteStatement text(connection_, "SELECT type, text FROM definitions WHERE id = ?1");
  if (!text.bind(1, definition).step()) return nullptr;
  std::shared_ptr<const FieldSlots> slots;
  try {
    slots = std::make_shared<const FieldSlots>(Schema::parse(text.text(0), text.text(1)));
  } catch (const MessageError&) {
  }
  return slots_[definition] = slots;
}

SqliteFieldIndex::OpenBlock& SqliteFieldIndex::blockOf(std::int64_t recording,
                                                       std::int64_t channel) {
  const auto known = blocks_.find(channel);
  if (known != blocks_.end()) return known->second;
  endAbandoned(recording, channel);
  OpenBlock& block = blocks_[channel];
  block.recording = recording;
  if (auto slots = slotsOf(channel)) {
    block.writer = std::make_unique<FieldBlockWriter>(std::move(slots));
  }
  return block;
}

void SqliteFieldIndex::add(std::int64_t recording, const Message& message) {
  OpenBlock& block = blockOf(recording, message.channel);
  if (!block.writer) return;
  const std::int64_t received_ns = message.received.ns;
  if (block.isEmpty()) {
    begin(message.channel, block, received_ns);
  } else if (received_ns < block.first_ns) {
    moveBegin(message.channel, block, received_ns);
  }
  block.last_ns = std::max(block.last_ns, received_ns);
  block.writer->add(message.bytes);
  if (block.writer->messages() >= FieldBlockWriter::kMostMessages) end(message.channel, block);
}

void SqliteFieldIndex::begin(std::int64_t channel, OpenBlock& block, std::int64_t received_ns) {
  block.id = newId();
  block.first_ns = block.last_ns = received_ns;
  connection_
      .prepared(
          "INSERT INTO field_blocks (channel, first_ns, id, last_ns, is_whole, ranges, bloom) "
          "VALUES (?1, ?2, ?3, ?4, 1, x'', x'')")
      .bind(1, channel)
      .bind(2, received_ns)
      .bind(3, block.id)
      .bind(4, kEndOfTime.ns)
      .run();
}

/// Messages of one channel come in order, but for those that another store sends.
void SqliteFieldIndex::moveBegin(std::int64_t channel, OpenBlock& block, std::int64_t received_ns) {
  connection_
      .prepared(
          "UPDATE field_blocks SET first_ns = ?4 WHERE channel = ?1 AND first_ns = ?2 AND id = ?3")
      .bind(1, channel)
      .bind(2, block.first_ns)
      .bind(3, block.id)
      .bind(4, received_ns)
      .run();
  block.first_ns = received_ns;
}

void SqliteFieldIndex::end(std::int64_t channel, OpenBlock& block) {
  const FieldBlock made = block.writer->finish();
  connection_
      .prepared(
          "UPDATE field_blocks SET last_ns = ?4, ranges = ?5, bloom = ?6 "
          "WHERE channel = ?1 AND first_ns = ?2 AND id = ?3")
      .bind(1, channel)
      .bind(2, block.first_ns)
      .bind(3, block.id)
      .bind(4, block.last_ns)
      .bind(5, made.ranges)
      .bind(6, made.bloom)
      .run();
}

void SqliteFieldIndex::cut(std::int64_t recording) {
  for (auto& [channel, block] : blocks_) {
    if (block.recording == recording && !block.isEmpty()) end(channel, block);
  }
}

/// A block that a writer which died, or a transaction that was undone, left open ends with the last
/// message of its channel; it still has no answers.
void SqliteFieldIndex::endAbandoned(std::int64_t recording, std::int64_t channel) {
  connection_
      .prepared(
          "UPDATE field_blocks SET last_ns = coalesce((SELECT received_ns FROM messages "
          "  WHERE recording = ?1 AND +channel = ?2 ORDER BY received_ns DESC LIMIT 1), first_ns) "
          "WHERE channel = ?2 AND last_ns = ?3")
      .bind(1, recording)
      .bind(2, channel)
      .bind(3, kEndOfTime.ns)
      .run();
}

bool SqliteFieldIndex::hasOpenBlocks() const {
  return std::any_of(blocks_.begin(), blocks_.end(),
                     [](const auto& entry) { return !entry.second.isEmpty(); });
}

void SqliteFieldIndex::cutAll() {
  for (auto& [channel, block] : blocks_) {
    if (!block.isEmpty()) end(channel, block);
  }
}

void SqliteFieldIndex::remove(std::int64_t recording, std::int64_t begin_ns, std::int64_t end_ns) {
  cut(recording);
  for (const char* sql :
       {"DELETE FROM field_blocks WHERE channel IN (SELECT id FROM channels WHERE recording = ?1) "
        "AND first_ns >= ?2 AND last_ns < ?3",
        "UPDATE field_blocks SET is_whole = 0 WHERE channel IN (SELECT id FROM channels "
        "WHERE recording = ?1) AND first_ns < ?3 AND last_ns >= ?2"}) {
    SqliteStatement(connection_, sql).bind(1, recording).bind(2, begin_ns).bind(3, end_ns).run();
  }
}

void SqliteFieldIndex::removeAll(std::int64_t recording) {
  SqliteStatement(connection_,
                  "DELETE FROM field_blocks WHERE channel IN (SELECT id FROM channels "
                  "WHERE recording = ?1)")
      .bind(1, recording)
      .run();
  for (auto block = blocks_.begin(); block != blocks_.end();) {
    block = block->second.recording == recording ? blocks_.erase(block) : std::next(block);
  }
  slots_.clear();
}

void SqliteFieldIndex::forget() {
  blocks_.clear();
  slots_.clear();
}

// ----------------------------------------------------------------------------------------- answers

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
    Answer answer = question.ask(viewOf(rows, 3), viewOf(rows, 4));
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

#include "replay/store/sqlite/sqlite_cursor.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

namespace afterglow::replay {
namespace {

/// A page ends with the message that reaches one of these.
constexpr std::size_t kReadMessages = 2048;
constexpr std::size_t kReadBytes = 4 << 20;

}  // namespace

SqliteCursor::SqliteCursor(SqliteConnection& connection, std::recursive_mutex& mutex,
                           SqliteFieldIndex& index, const Behavior& behavior,
                           const MessageRange& range)
    : connection_(connection),
      mutex_(mutex),
      index_(index),
      where_(range.where),
      recording_(behavior.recording) {
  const nlohmann::json topics = range.topics.empty() ? behavior.topics : range.topics;
  if (!range.with_all_topics) {
    topics_ = topics.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  const Stamp last{std::numeric_limits<std::int64_t>::max()};
  end_ns_ = std::min(behavior.end.value_or(last), range.end.value_or(last)).ns;
  received_ns_ = std::max(behavior.begin, range.begin.value_or(behavior.begin)).ns;
  const std::lock_guard<std::recursive_mutex> lock(mutex_);
  // The unary + keeps the planner from walking channel by channel, which would mean sorting.
  query_ = std::make_unique<SqliteStatement>(
      connection,
      "SELECT channel, received_ns, sequence, id FROM messages INDEXED BY messages_in_order "
      "WHERE recording = ?1 AND (received_ns, sequence, channel) > (?2, ?3, ?4) "
      "AND received_ns < ?5 AND (?6 IS NULL OR +channel IN (SELECT id FROM channels "
      "  WHERE recording = ?1 AND topic IN (SELECT value FROM json_each(?6)))) "
      "ORDER BY received_ns, sequence, channel");
  reader_ = std::make_unique<SqliteMessageReader>(connection);
}

SqliteCursor::~SqliteCursor() {
  const std::lock_guard<std::recursive_mutex> lock(mutex_);
  query_.reset();
  reader_.reset();
}

std::optional<Message> SqliteCursor::next() {
  if (page_.empty()) readPage();
  if (page_.empty()) return std::nullopt;
  std::optional<Message> message(std::move(page_.front()));
  page_.pop_front();
  return message;
}

ChannelAnswers& SqliteCursor::answersOf(std::int64_t channel) {
  const auto known = answers_.find(channel);
  if (known != answers_.end()) return known->second;
  return answers_
      .emplace(channel,
               ChannelAnswers(connection_, index_, channel, where_->root(), received_ns_, end_ns_))
      .first->second;
}

void SqliteCursor::readPage() {
  const std::lock_guard<std::recursive_mutex> lock(mutex_);
  const StatementScope scope(*query_);
  query_->bind(1, recording_).bind(2, received_ns_).bind(3, sequence_).bind(4, channel_);
  query_->bind(5, end_ns_).bind(6, topics_);
  std::size_t bytes = 0;
  while (page_.size() < kReadMessages && bytes < kReadBytes && query_->step()) {
    channel_ = query_->integer(0);
    received_ns_ = query_->integer(1);
    sequence_ = query_->integer(2);
    if (where_ && answersOf(channel_).isRuledOut(Stamp{received_ns_})) continue;
    auto contents = reader_->read(query_->integer(3));
    const Stamp received{received_ns_};
    const auto sequence = static_cast<std::uint64_t>(sequence_);
    if (!contents.problem.empty()) {
      damaged_.push_back({channel_, received, sequence, std::move(contents.problem)});
      continue;
    }
    Message message{channel_, received, sequence, contents.header_stamp, std::move(contents.bytes)};
    if (where_ && !answersOf(channel_).matches(message)) continue;
    bytes += message.bytes.size();
    page_.push_back(std::move(message));
  }
}

}  // namespace afterglow::replay

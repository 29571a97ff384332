#include "replay/store/sqlite/sqlite_cursor.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "replay/store/checksum.hpp"

namespace afterglow::replay {
namespace {

/// A page ends with the message that reaches one of these.
constexpr std::size_t kReadMessages = 2048;
constexpr std::size_t kReadBytes = 4 << 20;

}  // namespace

SqliteMessageReader::SqliteMessageReader(SqliteConnection& connection)
    : row_(connection, "SELECT header_stamp_ns, size, checksum, bytes FROM messages WHERE id = ?1"),
      chunks_(connection,
              "SELECT number, checksum, bytes FROM chunks WHERE message = ?1 ORDER BY number") {}

SqliteMessageReader::Contents SqliteMessageReader::read(std::int64_t message) {
  Contents contents;
  try {
    readRow(message, contents);
    if (is_chunked_ && contents.problem.empty()) readChunks(message, contents);
  } catch (const SqliteDamage& damage) {
    contents.problem = damage.reason();
  }
  if (!contents.problem.empty()) return contents;
  if (contents.bytes.size() != size_) {
    contents.problem =
        std::to_string(contents.bytes.size()) + " of " + std::to_string(size_) + " bytes are there";
  } else if (checksumOf(contents.bytes.data(), size_) != checksum_) {
    contents.problem = "the checksum is another";
  }
  return contents;
}

void SqliteMessageReader::readRow(std::int64_t message, Contents& contents) {
  const StatementScope scope(row_);
  if (!row_.bind(1, message).step()) {
    contents.problem = "its row is missing";
    is_chunked_ = false;
    return;
  }
  if (const auto stamp = row_.optionalInteger(0)) contents.header_stamp = Stamp{*stamp};
  size_ = static_cast<std::size_t>(row_.integer(1));
  checksum_ = row_.integer(2);
  is_chunked_ = row_.isNull(3);
  if (!is_chunked_) contents.bytes = row_.bytes(3);
}

void SqliteMessageReader::readChunks(std::int64_t message, Contents& contents) {
  const StatementScope scope(chunks_);
  chunks_.bind(1, message);
  for (std::int64_t number = 0; chunks_.step(); ++number) {
    const std::uint8_t* bytes = chunks_.data(2);
    const std::size_t size = chunks_.size(2);
    if (chunks_.integer(0) != number) {
      contents.problem = "chunk " + std::to_string(number) + " is missing";
      return;
    }
    if (checksumOf(bytes, size) != chunks_.integer(1)) {
      contents.problem = "the checksum of chunk " + std::to_string(number) + " is another";
      return;
    }
    contents.bytes.insert(contents.bytes.end(), bytes, bytes + size);
  }
}

// ----------------------------------------------------------------------------------------- cursor

SqliteCursor::SqliteCursor(SqliteConnection& connection, SqliteFieldIndex& index,
                           const Behavior& behavior, const MessageRange& range)
    : connection_(connection),
      index_(index),
      where_(range.where),
      recording_(behavior.recording) {
  const nlohmann::json topics = range.topics.empty() ? behavior.topics : range.topics;
  if (!range.with_all_topics) {
    topics_ = topics.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  end_ns_ = std::min(behavior.end.value_or(kEndOfTime), range.end.value_or(kEndOfTime)).ns;
  received_ns_ = std::max(behavior.begin, range.begin.value_or(behavior.begin)).ns;
  const SqliteLock lock = connection_.lock();
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
  const SqliteLock lock = connection_.lock();
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
  const SqliteLock lock = connection_.lock();
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

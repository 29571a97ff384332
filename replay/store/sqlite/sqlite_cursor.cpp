#include "replay/store/sqlite/sqlite_cursor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "replay/store/checksum.hpp"

namespace afterglow::replay {
namespace {

/// A page ends with the message that reaches this.
constexpr std::size_t kReadBytes = 4 << 20;

}  // namespace

SqliteMessageReader::SqliteMessageReader(SqliteConnection& connection)
    : row_(connection, std::string("SELECT ") + kColumns + " FROM messages WHERE id = ?1"),
      chunks_(connection,
              "SELECT number, checksum, bytes FROM chunks WHERE message = ?1 ORDER BY number") {}

SqliteMessageReader::Contents SqliteMessageReader::read(std::int64_t message) {
  Contents contents;
  try {
    const StatementScope scope(row_);
    if (row_.bind(1, message).step()) return read(row_, 0);
    contents.problem = "its row is missing";
  } catch (const SqliteDamage& damage) {
    contents.problem = damage.reason();
  }
  return contents;
}

SqliteMessageReader::Contents SqliteMessageReader::read(const SqliteStatement& row, int column) {
  Contents contents;
  if (const auto stamp = row.optionalInteger(column + 1)) contents.header_stamp = Stamp{*stamp};
  const auto size = static_cast<std::size_t>(row.integer(column + 2));
  const std::int64_t checksum = row.integer(column + 3);
  if (row.isNull(column + 4)) {
    readChunks(row.integer(column), contents);
  } else {
    contents.bytes = row.bytes(column + 4);
  }
  if (!contents.problem.empty()) return contents;
  if (contents.bytes.size() != size) {
    contents.problem =
        std::to_string(contents.bytes.size()) + " of " + std::to_string(size) + " bytes are there";
  } else if (checksumOf(contents.bytes.data(), size) != checksum) {
    contents.problem = "the checksum is another";
  }
  return contents;
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

SqliteCursor::SqliteCursor(SqliteConnection& connection, const Behavior& behavior,
                           const MessageRange& range, std::shared_ptr<const Condition> where,
                           std::size_t page)
    : connection_(connection),
      where_(std::move(where)),
      page_size_(page),
      recording_(behavior.recording) {
  const nlohmann::json topics = range.topics.empty() ? behavior.topics : range.topics;
  if (!range.with_all_topics) {
    topics_ = topics.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }
  end_ns_ = std::min(behavior.end.value_or(kEndOfTime), range.end.value_or(kEndOfTime)).ns;
  last_.received_ns = std::max(behavior.begin, range.begin.value_or(behavior.begin)).ns;
  const SqliteLock lock = connection_.lock();
  rows_ = select(SqliteMessageReader::kColumns);
  reader_ = std::make_unique<SqliteMessageReader>(connection);
}

/// The unary + keeps the planner from walking channel by channel, which would mean sorting.
std::unique_ptr<SqliteStatement> SqliteCursor::select(const char* columns) {
  const char* const of_topics =
      "AND +channel IN (SELECT id FROM channels WHERE recording = ?1 AND topic IN "
      "(SELECT value FROM json_each(?6))) ";
  return std::make_unique<SqliteStatement>(
      connection_, fmt::format("SELECT channel, received_ns, sequence, {} FROM messages "
                               "INDEXED BY messages_in_order WHERE recording = ?1 "
                               "AND (received_ns, sequence, channel) > (?2, ?3, ?4) "
                               "AND received_ns < ?5 {}ORDER BY received_ns, sequence, channel",
                               columns, topics_ ? of_topics : ""));
}

SqliteCursor::~SqliteCursor() {
  const SqliteLock lock = connection_.lock();
  rows_.reset();
  keys_.reset();
  reader_.reset();
}

std::optional<Message> SqliteCursor::next() {
  if (page_.empty()) readPage();
  if (page_.empty()) return std::nullopt;
  std::optional<Message> message(std::move(page_.front()));
  page_.pop_front();
  return message;
}

bool SqliteCursor::matches(const Message& message) {
  if (!where_) return true;
  auto known = matchers_.find(message.channel);
  if (known == matchers_.end()) {
    SqliteStatement query(connection_,
                          "SELECT type, text FROM channels c JOIN definitions d "
                          "ON d.id = c.definition WHERE c.id = ?1");
    const bool is_known = query.bind(1, message.channel).step();
    auto schema = is_known ? Schema::understood(query.text(0), query.text(1)) : nullptr;
    known = matchers_.try_emplace(message.channel, std::move(schema), *where_).first;
  }
  return known->second.matches(message);
}

void SqliteCursor::readPage() {
  const SqliteLock lock = connection_.lock();
  try {
    readPage(*rows_, true);
  } catch (const SqliteDamage&) {
    if (!keys_) keys_ = select("id");
    readPage(*keys_, false);
  }
}

void SqliteCursor::readPage(SqliteStatement& query, bool has_rows) {
  const StatementScope scope(query);
  query.bind(1, recording_)
      .bind(2, last_.received_ns)
      .bind(3, last_.sequence)
      .bind(4, last_.channel);
  query.bind(5, end_ns_);
  if (topics_) query.bind(6, topics_);
  std::size_t bytes = 0;
  while (page_.size() < page_size_ && bytes < kReadBytes && query.step()) {
    auto contents = has_rows ? reader_->read(query, 3) : reader_->read(query.integer(3));
    last_.channel = query.integer(0);
    last_.received_ns = query.integer(1);
    last_.sequence = query.integer(2);
    ++looked_;
    const Stamp received{last_.received_ns};
    const auto sequence = static_cast<std::uint64_t>(last_.sequence);
    if (!contents.problem.empty()) {
      damaged_.push_back({last_.channel, received, sequence, std::move(contents.problem)});
      continue;
    }
    Message message{last_.channel, received, sequence, contents.header_stamp,
                    std::move(contents.bytes)};
    if (!matches(message)) continue;
    bytes += message.bytes.size();
    page_.push_back(std::move(message));
  }
}

}  // namespace afterglow::replay

#include "replay/store/sqlite/sqlite_message_reader.hpp"

#include "replay/store/checksum.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

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

}  // namespace afterglow::replay

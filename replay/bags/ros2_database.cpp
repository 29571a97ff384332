#include "replay/bags/ros2_database.hpp"

#include <filesystem>
#include <utility>

#include "replay/bags/bag_file.hpp"

namespace afterglow::replay {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kMostTopics = 65'536;
constexpr std::int64_t kLongestText = 16 << 20;

/// A database whose log of commits was not folded in is read with that log.
SqliteAccess accessOf(const std::string& path) {
  std::error_code ignored;
  const auto log_size = fs::file_size(path + "-wal", ignored);
  return !ignored && log_size > 0 ? SqliteAccess::ReadOnly : SqliteAccess::ReadOnlyImmutable;
}

}  // namespace

void Ros2Database::fail(const std::string& text) const { throw BagError(path_ + ": " + text); }

template <typename Work>
auto Ros2Database::ask(const Work& work) const {
  try {
    return work();
  } catch (const StoreError& error) {
    const std::string text = error.what(), name = "sqlite:" + path_ + ": ";
    fail(text.compare(0, name.size(), name) == 0 ? text.substr(name.size()) : text);
  }
}

Ros2Database::Ros2Database(const std::string& path, FindDefinition find)
    : path_(path), intake_(std::move(find)) {
  ask([&] {
    connection_ = std::make_unique<SqliteConnection>(path, accessOf(path));
    connection_->execute("PRAGMA cell_size_check = ON");
    requireTable("topics");
    requireTable("messages");
    total_ = static_cast<std::uint64_t>(connection_->integer("SELECT COUNT(*) FROM messages"));
    begin_.ns = connection_->integer("SELECT MIN(timestamp) FROM messages");
    readTopics();
    // The row number is the order of recording; the store orders by stamps.
    messages_ = std::make_unique<SqliteStatement>(
        *connection_, "SELECT topic_id, timestamp, data, rowid FROM messages ORDER BY rowid");
  });
}

/// No view, nor a virtual table: what the file says may not compute anything.
void Ros2Database::requireTable(const std::string& name) {
  SqliteStatement found(*connection_,
                        "SELECT 1 FROM sqlite_master WHERE name = ? AND type = 'table' AND "
                        "sql LIKE 'CREATE TABLE%' AND sql NOT LIKE '%WITHOUT ROWID%'");
  if (!found.bind(1, std::string_view(name)).step()) {
    fail("is no bag of ROS 2: it has no table \"" + name + "\"");
  }
}

bool Ros2Database::hasColumn(const std::string& table, const std::string& column) {
  SqliteStatement found(*connection_, "SELECT 1 FROM pragma_table_info(?) WHERE name = ?");
  return found.bind(1, std::string_view(table)).bind(2, std::string_view(column)).step();
}

/// Returns the definitions by type.
std::map<std::string, Ros2Database::Definition> Ros2Database::readDefinitions() {
  std::map<std::string, Definition> definitions;
  if (!hasColumn("message_definitions", "encoded_message_definition")) return definitions;
  requireTable("message_definitions");
  SqliteStatement rows(*connection_,
                       "SELECT topic_type, encoding, encoded_message_definition "
                       "FROM message_definitions WHERE LENGTH(encoded_message_definition) < ? "
                       "LIMIT ?");
  rows.bind(1, kLongestText).bind(2, kMostTopics);
  while (rows.step()) definitions[rows.text(0)] = {rows.text(1), rows.text(2)};
  return definitions;
}

void Ros2Database::readTopics() {
  const auto definitions = readDefinitions();
  const std::string quality = hasColumn("topics", "offered_qos_profiles")
                                  ? "offered_qos_profiles" : "''";
  SqliteStatement rows(*connection_,
                       "SELECT id, name, type, serialization_format, " + quality +
                           " FROM topics WHERE LENGTH(name) < 4096 AND LENGTH(type) < 4096 "
                           "ORDER BY id LIMIT ?");
  rows.bind(1, kMostTopics);
  while (rows.step()) {
    Ros2Description topic{rows.text(1), rows.text(2), rows.text(3), "", "", rows.text(4)};
    const auto defined = definitions.find(topic.type);
    // "unknown": the recorder did not find it either.
    if (defined != definitions.end() && !defined->second.text.empty()) {
      topic.definition_kind = defined->second.kind;
      topic.definition = defined->second.text;
    }
    const auto id = static_cast<std::uint32_t>(ids_.size());
    ids_[rows.integer(0)] = id;
    intake_.addRos2(id, topic);
  }
}

std::optional<RecordedFile::Item> Ros2Database::next() {
  return ask([&]() -> std::optional<Item> {
    while (messages_->step()) {
      const auto topic = ids_.find(messages_->integer(0));
      const std::string row = std::to_string(messages_->integer(3));
      if (topic == ids_.end()) fail("message " + row + " is of a topic that is not there");
      const Stamp received{messages_->integer(1)};
      if (received.ns < 0) fail("message " + row + " has a stamp before 1970");
      if (auto bytes = intake_.take(topic->second, messages_->bytes(2))) {
        return Item{topic->second, received, *std::move(bytes)};
      }
    }
    return std::nullopt;
  });
}

}  // namespace afterglow::replay

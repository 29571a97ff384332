#include "replay/bags/recorded_file.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/bag_reader.hpp"
#include "replay/bags/mcap_reader.hpp"
#include "replay/messages/text.hpp"

namespace afterglow::replay {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kLongestMetadata = 4 << 20;

[[noreturn]] void fail(const std::string& path, const std::string& text) {
  throw BagError(path + ": " + text);
}

bool isPart(const fs::path& file) {
  return file.extension() == ".db3" || file.extension() == ".mcap";
}

/// The files that a bag of ROS 2 says to be made of: "- bag_0.db3" in its metadata, which a later
/// list repeats as "- path: bag_0.db3".
std::vector<std::string> namedParts(const std::string& metadata) {
  std::error_code ignored;
  if (fs::file_size(metadata, ignored) > kLongestMetadata) fail(metadata, "is too long");
  std::ifstream file(metadata);
  std::vector<std::string> names;
  for (std::string line; std::getline(file, line);) {
    const std::size_t dash = line.find_first_not_of(' ');
    if (dash == std::string::npos || line.compare(dash, 2, "- ") != 0) continue;
    const std::size_t begin = line.find_first_not_of(" \"'", dash + 1);
    if (begin == std::string::npos || line.compare(begin, 5, "path:") == 0) continue;
    // Early releases named the bag's folder, too.
    const fs::path name =
        fs::path(line.substr(begin, line.find_first_of("\"'\r", begin) - begin)).filename();
    if (name.extension() == ".zstd") {
      fail(metadata, "the bag is compressed as files; 'zstd -d --rm' unpacks " + name.string());
    }
    if (isPart(name)) names.push_back(name.string());
  }
  return names;
}

/// The files of a ROS 2 bag's folder.
std::vector<std::string> partsOf(const std::string& folder) {
  const fs::path metadata = fs::path(folder) / "metadata.yaml";
  std::error_code error;
  std::vector<std::string> parts;
  if (fs::is_regular_file(metadata, error)) {
    for (const std::string& name : namedParts(metadata.string())) {
      parts.push_back((fs::path(folder) / name).string());
    }
  }
  if (parts.empty()) {
    fs::directory_iterator end;
    for (fs::directory_iterator at(folder, error); !error && at != end; at.increment(error)) {
      if (isPart(at->path())) parts.push_back(at->path().string());
    }
    std::sort(parts.begin(), parts.end());
  }
  if (parts.empty()) fail(folder, "is a folder without a bag of ROS 2: no .db3 or .mcap is in it");
  return parts;
}

std::unique_ptr<RecordedFile> openFile(const std::string& path, const FindDefinition& find) {
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
    fail(path, "is no regular file");  // a pipe would be waited for
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(path, std::string("cannot open: ") + std::strerror(errno));
  std::string beginning(512, '\0');
  file.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
  beginning.resize(static_cast<std::size_t>(file.gcount()));
  file.close();
  if (const std::string other = otherThanRecording(beginning); !other.empty()) fail(path, other);
  if (beginsWith(beginning, "\x89MCAP")) return std::make_unique<McapFile>(path, find);
  if (beginsWith(beginning, "SQLite format 3")) return std::make_unique<Ros2Database>(path, find);
  return std::make_unique<BagReader>(path, find);
}

}  // namespace

std::vector<std::unique_ptr<RecordedFile>> openRecording(const std::string& path) {
  const FindDefinition find = findInstalled();
  std::error_code ignored;
  std::vector<std::string> files{path};
  if (fs::is_directory(path, ignored)) files = partsOf(path);
  std::vector<std::unique_ptr<RecordedFile>> recording;
  for (const std::string& file : files) recording.push_back(openFile(file, find));
  return recording;
}

namespace {

constexpr const char* kConverted =
    "went through a conversion of line ends (FTP's text mode, Git's autocrlf), which changed its "
    "bytes; get it again as binary";

struct Kind {
  std::string_view first;
  const char* text;
};

/// Sources: the formats' own specifications; file(1)'s magic.
constexpr Kind kKinds[] = {
    {"#ROSBAG V2.0\r", kConverted},
    {"\x89MCAP0\r\r\n", kConverted},
    {"\x89MCAP0\n", kConverted},
    {"\x1f\x8b", "is compressed by gzip; 'gunzip' unpacks it"},
    {"BZh", "is compressed by bzip2; 'bunzip2' unpacks it"},
    {"\xfd"
     "7zXZ",
     "is compressed by xz; 'unxz' unpacks it"},
    {"\x28\xb5\x2f\xfd", "is compressed by zstd; 'zstd -d' unpacks it"},
    {"\x04\x22\x4d\x18", "is compressed by lz4; 'lz4 -d' unpacks it"},
    {"PK\x03\x04", "is a ZIP archive; 'unzip' unpacks it"},
    {"7z\xbc\xaf", "is a 7z archive; '7z x' unpacks it"},
    {"Rar!", "is a RAR archive; 'unrar x' unpacks it"},
    {"version https://git-lfs.github.com",
     "is a Git LFS pointer, not the file itself; 'git lfs pull' fetches that"},
    {"/annex/objects/",
     "is a git-annex pointer, not the file itself; 'git annex get' fetches that"},
    {"../.git/annex/objects/",
     "is a git-annex pointer, not the file itself; 'git annex get' fetches that"},
    {"#ROSRECORD", "is a recording from before ROS 1.0; 'rosbag fix' of that time converts it"}};

/// Returns the beginning without byte order mark and blanks, in small letters.
std::string asMarkup(std::string_view beginning) {
  if (beginsWith(beginning, "\xef\xbb\xbf")) beginning.remove_prefix(3);
  const std::size_t first = beginning.find_first_not_of(" \t\r\n");
  return lowerCase(std::string(beginning.substr(std::min(first, beginning.size()))));
}

}  // namespace

FileBytes::FileBytes(const std::string& path) : path_(path), file_(path, std::ios::binary) {
  if (!file_) fail(std::string("cannot open: ") + std::strerror(errno));
  std::error_code error;
  size_ = fs::file_size(path, error);
  if (error) fail("cannot open: " + error.message());
}

void FileBytes::fail(const std::string& text) const { throw BagError(path_ + ": " + text); }

Bytes FileBytes::read(std::uint64_t at, std::uint64_t size, const char* what) {
  if (at > size_ || size > size_ - at) {
    fail("is cut short: " + std::string(what) + " at byte " + std::to_string(at) + " needs " +
         std::to_string(size) + " bytes, the file has " + std::to_string(size_));
  }
  Bytes bytes(size);
  file_.seekg(static_cast<std::streamoff>(at));
  file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!file_) fail("cannot read at byte " + std::to_string(at));
  return bytes;
}

std::string otherThanRecording(std::string_view beginning) {
  if (beginning.empty()) return "is empty";
  if (beginning.find_first_not_of('\0') == std::string_view::npos) {
    return "holds zeros at its beginning, as after a lost power or a download that did not end";
  }
  for (const Kind& kind : kKinds) {
    if (beginsWith(beginning, kind.first)) return kind.text;
  }
  if (beginning.size() > 262 && beginning.compare(257, 5, "ustar") == 0) {
    return "is a tar archive; 'tar -xf' unpacks it";
  }
  const std::string markup = asMarkup(beginning);
  const char* const kNotFile = ", as a server answers that has not, or does not give, the file";
  if (beginsWith(markup, "<!doctype html") || beginsWith(markup, "<html") ||
      beginsWith(markup, "<head")) {
    return "is a web page, not the file that its link leads to; get the file itself";
  }
  if (beginsWith(markup, "<?xml")) return std::string("is XML") + kNotFile;
  if (beginsWith(markup, "{\"")) return std::string("is JSON") + kNotFile;
  return "";
}

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

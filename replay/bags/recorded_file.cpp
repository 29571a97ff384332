#include "replay/bags/recorded_file.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/bag_reader.hpp"
#include "replay/bags/mcap_reader.hpp"
#include "replay/bags/ros2_database.hpp"
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

}  // namespace afterglow::replay

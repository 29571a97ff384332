#include "replay/bags/recorded_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "replay/bags/bag_file.hpp"
#include "replay/bags/bag_reader.hpp"
#include "replay/bags/file_kind.hpp"
#include "replay/bags/mcap_file.hpp"
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

}  // namespace afterglow::replay

#include "replay/bags/file_kind.hpp"

#include <algorithm>
#include <cctype>

#include "replay/messages/text.hpp"

namespace afterglow::replay {
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
    {"\xfd" "7zXZ", "is compressed by xz; 'unxz' unpacks it"},
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

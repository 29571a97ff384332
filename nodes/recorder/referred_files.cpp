#include "nodes/recorder/referred_files.hpp"

#include <ros/package.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "nodes/conversion/geometry_conversion.hpp"
#include "replay/store/checksum.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

const std::string kPackage = "package://", kFile = "file://";
constexpr std::uintmax_t kLargest = 20u << 20;
constexpr std::size_t kLongestUri = 1024;

bool begins(const std::string& text, const std::string& with) {
  return text.compare(0, with.size(), with) == 0;
}

bool isSoundOrMesh(const fs::path& path) {
  static const std::set<std::string> kKnown = {".wav",  ".ogg", ".oga",  ".mp3", ".flac",
                                               ".aiff", ".stl", ".stlb", ".dae", ".mesh",
                                               ".obj",  ".ply", ".glb",  ".gltf"};
  std::string extension = path.extension();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return kKnown.count(extension) != 0;
}

/// Throws std::runtime_error saying why there is no such file.
fs::path pathOf(const std::string& uri) {
  if (uri.size() > kLongestUri || uri.find('\0') != std::string::npos) {
    throw std::runtime_error("its name is too long or holds a NUL");
  }
  if (begins(uri, kFile)) return uri.substr(kFile.size());
  if (!begins(uri, kPackage)) throw std::runtime_error("neither package:// nor file://");
  const std::string rest = uri.substr(kPackage.size());
  const std::string package = rest.substr(0, rest.find('/'));
  const std::string folder = ros::package::getPath(package);
  if (folder.empty()) throw std::runtime_error("there is no ROS package of that name");
  return folder + rest.substr(package.size());
}

replay::Bytes contentsOf(const std::string& uri) {
  const fs::path path = pathOf(uri);
  std::error_code error;
  if (!isSoundOrMesh(path)) throw std::runtime_error("no sound and no mesh by its name");
  if (!fs::is_regular_file(path, error)) throw std::runtime_error("there is no such file");
  if (fs::file_size(path, error) > kLargest) throw std::runtime_error("larger than 20 MiB");
  std::ifstream file(path, std::ios::binary);
  replay::Bytes bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw std::runtime_error("it cannot be read");
  return bytes;
}

}  // namespace

std::map<std::string, std::string> keepFiles(replay::Store& store,
                                             const std::set<std::string>& uris,
                                             std::vector<std::string>& remarks) {
  std::map<std::string, std::string> kept;
  for (const std::string& uri : uris) {
    replay::Bytes contents;
    try {
      contents = contentsOf(uri);
    } catch (const std::runtime_error& error) {
      remarks.push_back("the file '" + printable(uri.substr(0, kLongestUri)) +
                        "' was not kept: " + error.what());
      continue;
    }
    const std::string hash = replay::sha256(contents);
    store.addFile(hash, contents);
    kept[uri] = hash;
  }
  return kept;
}

bool isHere(const std::string& uri) {
  try {
    std::error_code error;
    return fs::is_regular_file(pathOf(uri), error);
  } catch (const std::runtime_error&) {
    return false;
  }
}

}  // namespace afterglow::nodes

#include "nodes/conversion/resource_file.hpp"

#include <ros/package.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "replay/messages/text.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

const std::string kPackage = "package://", kFile = "file://";

bool isPackageName(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_' || c == '-';
  });
}

ResourceFile fileInPackage(const std::string& name_and_path) {
  const std::size_t slash = name_and_path.find('/');
  const std::string name = name_and_path.substr(0, slash);
  if (!isPackageName(name) || slash == std::string::npos) {
    throw std::runtime_error("not package://NAME/PATH");
  }
  const std::string folder = ros::package::getPath(name);
  if (folder.empty()) throw std::runtime_error("there is no ROS package of that name");
  return {folder + name_and_path.substr(slash), folder};
}

}  // namespace

ResourceFile resourceFile(const std::string& uri) {
  if (uri.size() > kLongestResource) throw std::runtime_error("longer than 1024 characters");
  if (uri.find('\0') != std::string::npos) throw std::runtime_error("a NUL in its name");
  const fs::path parts(uri);
  if (std::find(parts.begin(), parts.end(), "..") != parts.end()) {
    throw std::runtime_error("'..' is not followed");
  }
  if (replay::beginsWith(uri, kPackage)) return fileInPackage(uri.substr(kPackage.size()));
  if (!replay::beginsWith(uri, kFile)) throw std::runtime_error("neither package:// nor file://");
  const std::string path = uri.substr(kFile.size());
  if (path.empty() || path.front() != '/') throw std::runtime_error("not file:///PATH");
  return {path, {}};
}

bool isInside(const fs::path& path, const fs::path& folder) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(path, error), root = fs::canonical(folder, error);
  return !error &&
         std::mismatch(root.begin(), root.end(), real.begin(), real.end()).first == root.end();
}

std::vector<std::string> packageFolders() {
  std::vector<std::string> names, folders;
  ros::package::getAll(names);
  for (const std::string& name : names) folders.push_back(ros::package::getPath(name));
  folders.erase(std::remove(folders.begin(), folders.end(), ""), folders.end());
  return folders;
}

}  // namespace afterglow::nodes

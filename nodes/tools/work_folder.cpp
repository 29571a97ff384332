#include "nodes/tools/work_folder.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace afterglow::nodes {

WorkFolder::WorkFolder(const std::string& file) : path_(file + ".parts.XXXXXX") {
  if (::mkdtemp(path_.data()) == nullptr) {
    throw std::runtime_error(path_ + ": cannot make the folder: " + std::strerror(errno));
  }
}

WorkFolder::~WorkFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string WorkFolder::path(const std::string& name) const { return path_ + "/" + name; }

std::string WorkFolder::folder(const std::string& name) const {
  std::filesystem::create_directory(path(name));
  return path(name);
}

}  // namespace afterglow::nodes

#include "replay/store/private_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {
namespace {

struct Modes {
  mode_t file, folder;
};

Modes modesAsked() {
  const char* named = std::getenv("AFTERGLOW_STORE_ACCESS");
  const std::string access = named ? named : "";
  if (access == "group") return {0660, 0770};
  if (access == "all") return {0664, 0775};
  if (access.empty() || access == "private") return {0600, 0700};
  throw StoreError("AFTERGLOW_STORE_ACCESS is \"" + access + "\": private, group or all");
}

}  // namespace

void makePrivateFolder(const std::string& folder) {
  namespace fs = std::filesystem;
  const mode_t mode = modesAsked().folder;
  std::vector<fs::path> missing;
  std::error_code error;
  for (fs::path at = folder; !at.empty() && !fs::exists(at, error); at = at.parent_path()) {
    missing.push_back(at);
    if (at == at.parent_path()) break;
  }
  for (auto at = missing.rbegin(); at != missing.rend(); ++at) {
    // Another process may make it meanwhile; "a/." is there with "a".
    const bool is_made = mkdir(at->c_str(), mode) == 0 && chmod(at->c_str(), mode) == 0;
    const int why = errno;
    if (!is_made && !fs::is_directory(*at, error)) {
      throw StoreError("cannot make the folder " + at->string() + ": " + std::strerror(why));
    }
  }
}

std::string realFile(const std::string& path) {
  namespace fs = std::filesystem;
  constexpr int kMostLinks = 40;  // as the kernel follows
  fs::path real = path;
  std::error_code error;
  for (int i = 0; i < kMostLinks && fs::is_symlink(real, error); ++i) {
    real = real.parent_path() / fs::read_symlink(real, error);
  }
  return real.string();
}

int makePrivateFile(const std::string& path, const std::string& like) {
  struct stat other {};
  const bool has_other = !like.empty() && stat(like.c_str(), &other) == 0;
  const mode_t mode = has_other ? other.st_mode & 0666 : modesAsked().file;
  const int made = open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  // A file system without modes has what its mount gives.
  if (made >= 0 && fchmod(made, mode) != 0) return made;
  return made;
}

}  // namespace afterglow::replay

#include "calib/file_replacement.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace afterglow::calib {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const std::string& path, int reason) {
  throw std::runtime_error(path + ": cannot be written: " + std::strerror(reason) +
                           " (what was there before is unchanged)");
}

/// Closes the file in the destructor; close() also reports errors of closing.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }
  int close() {
    const int number = number_;
    number_ = -1;
    return ::close(number);
  }

 private:
  int number_;
};

/// Returns 0 or the reason.
int writeAll(int file, const std::string& content) {
  std::size_t written = 0;
  while (written < content.size()) {
    const ssize_t count = ::write(file, content.data() + written, content.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return count < 0 ? errno : EIO;
    written += static_cast<std::size_t>(count);
  }
  return 0;
}

/// Returns 0 or the reason. Overwrites a file of that name, which an earlier crash left.
int writeNew(const std::string& path, const std::string& content) {
  ::unlink(path.c_str());
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.number() < 0) return errno;
  const int reason = writeAll(file.number(), content);
  if (reason != 0) return reason;
  if (::fsync(file.number()) != 0) return errno;
  return file.close() == 0 ? 0 : errno;
}

/// Writes the names in a folder to the disk, too. File systems that cannot do it return EINVAL.
void syncFolder(const std::string& folder) {
  Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.number() < 0) return;  // it may be written but not read: nothing can be done
  if (::fsync(directory.number()) != 0 && errno != EINVAL) refuse(folder, errno);
}

std::string folderOf(const std::string& path) {
  const std::string folder = fs::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

std::string beside(const std::string& path, const std::string& what) {
  return (fs::path(folderOf(path)) /
          ("." + fs::path(path).filename().string() + "." + std::to_string(::getpid()) + what))
      .string();
}

/// A second name (or, without hard links, a copy) of the file at a path; empty if there is no file.
/// Returns 0 or the reason.
int keep(const std::string& path, std::string& previous) {
  const std::string name = beside(path, ".old");
  ::unlink(name.c_str());
  if (::link(path.c_str(), name.c_str()) != 0) {
    if (errno == ENOENT) return 0;
    std::error_code error;
    if (fs::is_directory(path, error)) return EISDIR;
    if (!fs::copy_file(path, name, error)) return error.value() != 0 ? error.value() : EIO;
  }
  previous = name;
  return 0;
}

/// The file that writing to a path changes: a link's target, if it is a link.
std::string linkFollowed(const std::string& path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return path;
  const fs::path target = fs::canonical(path, error);
  return error ? path : target.string();
}

}  // namespace

FileReplacement::~FileReplacement() { takeBack(); }

void FileReplacement::makeFolders(const std::string& folder) {
  struct stat status {};
  if (::stat(folder.c_str(), &status) == 0) {
    if (!S_ISDIR(status.st_mode)) refuse(folder, ENOTDIR);
    return;
  }
  const std::string parent = folderOf(folder);
  if (parent != folder) makeFolders(parent);
  if (::mkdir(folder.c_str(), 0777) == 0) {
    folders_made_.push_back(folder);
  } else if (errno != EEXIST) {
    refuse(folder, errno);
  }
}

void FileReplacement::add(const std::string& path, const std::string& content) {
  File file;
  file.path = linkFollowed(path);
  makeFolders(folderOf(file.path));
  struct stat status {};
  if (::stat(file.path.c_str(), &status) == 0 && S_ISDIR(status.st_mode)) refuse(path, EISDIR);
  file.temporary = beside(file.path, ".new");
  files_.push_back(file);
  const int reason = writeNew(file.temporary, content);
  if (reason != 0) {
    takeBack();
    refuse(path, reason);
  }
}

void FileReplacement::commit() {
  for (File& file : files_) {
    int reason = keep(file.path, file.previous);
    if (reason == 0 && std::rename(file.temporary.c_str(), file.path.c_str()) != 0) reason = errno;
    if (reason != 0) {
      const std::string path = file.path;
      takeBack();
      refuse(path, reason);
    }
    file.temporary.clear();
    file.is_replaced = true;
  }
  for (const File& file : files_) syncFolder(folderOf(file.path));
  for (const std::string& folder : folders_made_) syncFolder(folderOf(folder));
  for (const File& file : files_) {
    if (!file.previous.empty()) ::unlink(file.previous.c_str());
  }
  files_.clear();
  folders_made_.clear();
}

void FileReplacement::takeBack() noexcept {
  for (auto file = files_.rbegin(); file != files_.rend(); ++file) {
    if (!file->temporary.empty()) ::unlink(file->temporary.c_str());
    if (file->is_replaced && file->previous.empty()) ::unlink(file->path.c_str());
    if (file->is_replaced && !file->previous.empty()) {
      std::rename(file->previous.c_str(), file->path.c_str());
    } else if (!file->previous.empty()) {
      ::unlink(file->previous.c_str());
    }
  }
  for (auto folder = folders_made_.rbegin(); folder != folders_made_.rend(); ++folder) {
    ::rmdir(folder->c_str());
  }
  files_.clear();
  folders_made_.clear();
}

void replaceFile(const std::string& path, const std::string& content) {
  FileReplacement replacement;
  replacement.add(path, content);
  replacement.commit();
}

}  // namespace afterglow::calib

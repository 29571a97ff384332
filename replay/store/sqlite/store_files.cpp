#include "replay/store/sqlite/store_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {
namespace {

/// Makes a lock of `size` bytes; 0: all. The commands F_OFD_* make it a lock of the open file, not
/// of the process: two stores in one process exclude each other, a lock can be asked about without
/// being taken, and NFS knows it.
struct flock bytesFrom(std::int64_t begin, std::int64_t size) {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = begin;
  lock.l_len = size;
  return lock;
}

bool isHeld(const LockFile& file, struct flock lock) {
  return fcntl(file.descriptor(), F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

/// A store has one lock, whatever links lead to it.
std::string recorderPath(const std::string& store) { return realFile(store) + ".lock"; }
std::string importsPath(const std::string& store) { return realFile(store) + ".imports"; }

[[noreturn]] void fail(const std::string& store, const char* doing, const std::string& path) {
  throw StoreError("sqlite:" + store + ": cannot " + doing + " " + path + ": " +
                   std::strerror(errno));
}

LockFile openLockFile(const std::string& store, const std::string& path) {
  // As the store: who may write to that may lock it.
  int file = makePrivateFile(path, store);
  if (file < 0 && errno == EEXIST) file = open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) fail(store, "make", path);
  return LockFile(file);
}

std::string holderIn(const LockFile& file) {
  std::array<char, 200> text{};
  const auto size = pread(file.descriptor(), text.data(), text.size(), 0);
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "another process";
}

std::string ownName() {
  std::array<char, 100> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '?';
  return "process " + std::to_string(getpid()) + " on " + host.data();
}

}  // namespace

LockFile::LockFile(LockFile&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

LockFile::~LockFile() {
  if (file_ >= 0) close(file_);
}

RecorderLock::RecorderLock(const std::string& store)
    : file_(openLockFile(store, recorderPath(store))) {
  struct flock lock = bytesFrom(0, 0);
  if (fcntl(file_.descriptor(), F_OFD_SETLK, &lock) != 0) {
    const bool is_held = errno == EAGAIN || errno == EACCES;
    const std::string why = is_held ? holderIn(file_) + " records into it" : std::strerror(errno);
    throw StoreError("sqlite:" + store + ": cannot record: " + why);
  }
  // The holder's name is only for people: a failure to write it is no reason not to record.
  const std::string name = ownName();
  if (ftruncate(file_.descriptor(), 0) != 0 ||
      pwrite(file_.descriptor(), name.data(), name.size(), 0) < 0) {
    return;
  }
}

std::optional<std::string> recorderOf(const std::string& store) {
  const LockFile file(open(recorderPath(store).c_str(), O_RDONLY | O_CLOEXEC));
  if (!isHeld(file, bytesFrom(0, 0))) return std::nullopt;
  return holderIn(file);
}

ImportLock::ImportLock(const std::string& store, std::int64_t recording)
    : file_(openLockFile(store, importsPath(store))) {
  struct flock lock = bytesFrom(recording, 1);
  while (fcntl(file_.descriptor(), F_OFD_SETLKW, &lock) != 0) {
    if (errno != EINTR) fail(store, "lock", importsPath(store));
  }
}

std::optional<ImportLock> ImportLock::ofDead(const std::string& store, std::int64_t recording) {
  LockFile file = openLockFile(store, importsPath(store));
  struct flock lock = bytesFrom(recording, 1);
  if (fcntl(file.descriptor(), F_OFD_SETLK, &lock) == 0) return ImportLock(std::move(file));
  if (errno != EAGAIN && errno != EACCES) fail(store, "lock", importsPath(store));
  return std::nullopt;
}

bool isImporting(const std::string& store, std::int64_t recording) {
  const LockFile file(open(importsPath(store).c_str(), O_RDONLY | O_CLOEXEC));
  return isHeld(file, bytesFrom(recording, 1));
}

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
    const int unsynced = is_made ? syncName(*at) : 0;
    if (unsynced != 0 || (!is_made && !fs::is_directory(*at, error))) {
      throw StoreError("cannot make the folder " + at->string() + ": " +
                       std::strerror(is_made ? unsynced : why));
    }
  }
}

int syncName(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path();
  const int file = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return 0;
  const int why = fsync(file) == 0 || errno == EINVAL ? 0 : errno;
  close(file);
  return why;
}

void requireSyncedName(const std::string& path) {
  if (const int why = syncName(path); why != 0) {
    throw std::filesystem::filesystem_error(path, std::error_code(why, std::generic_category()));
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

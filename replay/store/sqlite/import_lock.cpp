#include "replay/store/sqlite/import_lock.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace afterglow::replay {
namespace {

std::string pathOf(const std::string& store) { return store + ".imports"; }

[[noreturn]] void fail(const std::string& store, const char* doing) {
  throw StoreError("sqlite:" + store + ": cannot " + doing + " " + pathOf(store) + ": " +
                   std::strerror(errno));
}

int openFile(const std::string& store) {
  const int file = open(pathOf(store).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0) fail(store, "make");
  return file;
}

/// As RecorderLock: an open file's own lock, not the process's.
struct flock byteOf(std::int64_t recording) {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = recording;
  lock.l_len = 1;
  return lock;
}

}  // namespace

ImportLock::ImportLock(const std::string& store, std::int64_t recording) : file_(openFile(store)) {
  struct flock lock = byteOf(recording);
  while (fcntl(file_, F_OFD_SETLKW, &lock) != 0) {
    if (errno == EINTR) continue;
    close(file_);
    fail(store, "lock");
  }
}

std::optional<ImportLock> ImportLock::ofDead(const std::string& store, std::int64_t recording) {
  ImportLock made(openFile(store));
  struct flock lock = byteOf(recording);
  if (fcntl(made.file_, F_OFD_SETLK, &lock) == 0) return made;
  if (errno != EAGAIN && errno != EACCES) fail(store, "lock");
  return std::nullopt;
}

ImportLock::ImportLock(ImportLock&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

ImportLock::~ImportLock() {
  if (file_ >= 0) close(file_);
}

std::vector<std::int64_t> unfinishedImports(SqliteConnection& connection) {
  // The table comes with the first import.
  if (connection.integer("SELECT count(*) FROM sqlite_schema WHERE name = 'imports'") == 0) {
    return {};
  }
  SqliteStatement query(connection, "SELECT recording FROM imports ORDER BY recording");
  std::vector<std::int64_t> found;
  while (query.step()) found.push_back(query.integer(0));
  return found;
}

bool isImporting(const std::string& store, std::int64_t recording) {
  const int file = open(pathOf(store).c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  struct flock lock = byteOf(recording);
  const bool is_held = fcntl(file, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  close(file);
  return is_held;
}

}  // namespace afterglow::replay

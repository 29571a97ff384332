#include "replay/store/sqlite/recorder_lock.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "replay/store/store.hpp"

namespace afterglow::replay {
namespace {

/// Of the whole file. An open file's own lock (not the process's): two stores in one process
/// exclude each other, it can be asked about without being taken, and NFS knows it.
struct flock wholeFile() {
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  return lock;
}

std::string holderIn(int file) {
  std::array<char, 200> text{};
  const auto size = pread(file, text.data(), text.size(), 0);
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "another process";
}

std::string ownName() {
  std::array<char, 100> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '?';
  return "process " + std::to_string(getpid()) + " on " + host.data();
}

}  // namespace

RecorderLock::RecorderLock(const std::string& store) {
  const std::string path = store + ".lock";
  file_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0) {
    throw StoreError("sqlite:" + store + ": cannot make " + path + ": " + std::strerror(errno));
  }
  struct flock lock = wholeFile();
  if (fcntl(file_, F_OFD_SETLK, &lock) != 0) {
    const bool is_held = errno == EAGAIN || errno == EACCES;
    const std::string why = is_held ? holderIn(file_) + " records into it" : std::strerror(errno);
    close(file_);
    throw StoreError("sqlite:" + store + ": cannot record: " + why);
  }
  // Who holds it is only for people: not being able to say it is no reason not to record.
  const std::string name = ownName();
  if (ftruncate(file_, 0) != 0 || pwrite(file_, name.data(), name.size(), 0) < 0) return;
}

RecorderLock::~RecorderLock() { close(file_); }

std::optional<std::string> recorderOf(const std::string& store) {
  const int file = open((store + ".lock").c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  struct flock lock = wholeFile();
  const bool is_held = fcntl(file, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  std::optional<std::string> holder;
  if (is_held) holder = holderIn(file);
  close(file);
  return holder;
}

}  // namespace afterglow::replay

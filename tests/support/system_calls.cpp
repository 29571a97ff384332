#include "tests/support/system_calls.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <mutex>
#include <new>

namespace afterglow::test {
namespace {

std::atomic<int> counted_kind{-1};
std::atomic<long> calls{0};
std::atomic<long> failing_call{0};
std::atomic<int> failing_error{0};

thread_local int uncounted = 0;

std::atomic<FileListener*> listener{nullptr};
std::recursive_mutex listening;

/// Whether this call is the one that fails; errno is set then.
bool fails(CallKind kind) {
  if (counted_kind.load(std::memory_order_relaxed) != static_cast<int>(kind)) return false;
  if (uncounted > 0) return false;
  if (++calls != failing_call) return false;
  errno = failing_error;
  return true;
}

/// Makes a change that may fail, and tells it. `make` returns what the system call does, below 0
/// for an error.
template <typename Make, typename Tell>
auto changed(CallKind kind, const Make& make, const Tell& tell) -> decltype(make()) {
  if (fails(kind)) return -1;
  if (!listener) return make();
  const std::lock_guard<std::recursive_mutex> lock(listening);
  const auto result = make();
  const int error = errno;
  if (result >= 0) listener.load()->onChange(tell(result));
  errno = error;
  return result;
}

std::string bytesOf(const void* from, ssize_t size) {
  return {static_cast<const char*>(from), static_cast<std::size_t>(size)};
}

FileChange written(int file, std::int64_t offset, std::string bytes) {
  FileChange change{FileChange::Kind::Write, file};
  change.offset = offset;
  change.bytes = std::move(bytes);
  return change;
}

bool isRegular(int file) {
  struct stat status {};
  return file > 2 && fstat(file, &status) == 0 && S_ISREG(status.st_mode);
}

/// At the file's own place, which is moved.
std::int64_t placeBefore(int file, ssize_t size) { return lseek(file, 0, SEEK_CUR) - size; }

int opened(int folder, const char* path, int flags, mode_t mode) {
  const auto make = [&] {
    return static_cast<int>(syscall(SYS_openat, folder, path, flags, mode));
  };
  struct stat status {};
  const bool is_there = fstatat(folder, path, &status, 0) == 0;
  if (!is_there && (flags & O_CREAT) != 0) {
    return changed(CallKind::Write, make, [&](int file) {
      return FileChange{FileChange::Kind::Make, file, path};
    });
  }
  if (is_there && S_ISREG(status.st_mode) && (flags & O_TRUNC) != 0) {
    return changed(CallKind::Write, make, [&](int file) {
      return FileChange{FileChange::Kind::Truncate, file};
    });
  }
  return make();
}

int named(FileChange::Kind kind, const char* path, const char* other, long number,
          mode_t mode = 0) {
  return changed(
      CallKind::Write,
      [&] {
        if (other) return static_cast<int>(syscall(number, AT_FDCWD, path, AT_FDCWD, other, 0));
        return static_cast<int>(syscall(number, AT_FDCWD, path, mode));
      },
      [&](int) {
        return FileChange{kind, -1, path, other ? other : ""};
      });
}

}  // namespace

void countCalls(CallKind kind, long n, int error) {
  calls = 0;
  failing_call = n;
  failing_error = error;
  counted_kind = static_cast<int>(kind);
}

long countedCalls() {
  counted_kind = -1;
  return calls;
}

UncountedCalls::UncountedCalls() { ++uncounted; }
UncountedCalls::~UncountedCalls() { --uncounted; }

void listenToFiles(FileListener* to) {
  const std::lock_guard<std::recursive_mutex> lock(listening);
  listener = to;
}

}  // namespace afterglow::test

// What follows stands before the C library's own in every library that this program loads.
extern "C" {

// A sanitizer has its own, and wants them.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  return afterglow::test::fails(afterglow::test::CallKind::Memory) ? nullptr : __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  if (afterglow::test::fails(afterglow::test::CallKind::Memory)) return nullptr;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  if (afterglow::test::fails(afterglow::test::CallKind::Memory)) return nullptr;
  return __libc_realloc(memory, size);
}
void free(void* memory) { __libc_free(memory); }
#endif

ssize_t write(int file, const void* from, std::size_t size) {
  using namespace afterglow::test;
  const auto make = [&] { return syscall(SYS_write, file, from, size); };
  if (!isRegular(file)) return make();
  return changed(CallKind::Write, make, [&](ssize_t done) {
    return written(file, placeBefore(file, done), bytesOf(from, done));
  });
}

ssize_t writev(int file, const iovec* parts, int count) {
  using namespace afterglow::test;
  const auto make = [&] { return syscall(SYS_writev, file, parts, count); };
  if (!isRegular(file)) return make();
  return changed(CallKind::Write, make, [&](ssize_t done) {
    std::string bytes;
    for (int i = 0; i < count; ++i) {
      bytes += bytesOf(parts[i].iov_base, static_cast<ssize_t>(parts[i].iov_len));
    }
    bytes.resize(static_cast<std::size_t>(done));
    return written(file, placeBefore(file, done), std::move(bytes));
  });
}

ssize_t pwrite64(int file, const void* from, std::size_t size, off64_t offset) {
  using namespace afterglow::test;
  return changed(
      CallKind::Write, [&] { return syscall(SYS_pwrite64, file, from, size, offset); },
      [&](ssize_t done) { return written(file, offset, bytesOf(from, done)); });
}
ssize_t pwrite(int file, const void* from, std::size_t size, off_t offset) {
  return pwrite64(file, from, size, offset);
}

int ftruncate64(int file, off64_t size) noexcept {
  using namespace afterglow::test;
  return changed(
      CallKind::Write, [&] { return static_cast<int>(syscall(SYS_ftruncate, file, size)); },
      [&](int) {
        FileChange change{FileChange::Kind::Truncate, file};
        change.offset = size;
        return change;
      });
}
int ftruncate(int file, off_t size) noexcept { return ftruncate64(file, size); }

// What the kernel has outlives a process, and only loss of power would need more: it takes long.
int fsync(int file) {
  using namespace afterglow::test;
  return changed(
      CallKind::Sync, [] { return 0; },
      [&](int) {
        return FileChange{FileChange::Kind::Sync, file};
      });
}
int fdatasync(int file) {
  using namespace afterglow::test;
  return changed(
      CallKind::Sync, [] { return 0; },
      [&](int) {
        return FileChange{FileChange::Kind::Sync, file};
      });
}

int open64(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return afterglow::test::opened(AT_FDCWD, path, flags, mode);
}
int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return afterglow::test::opened(AT_FDCWD, path, flags, mode);
}

/// As std::ofstream and std::ifstream open files: the C library's own would not ask open() above.
FILE* fopen64(const char* path, const char* mode) {
  const bool is_both = std::string(mode).find('+') != std::string::npos;
  const int way = mode[0] == 'r' ? 0 : O_CREAT | (mode[0] == 'w' ? O_TRUNC : O_APPEND);
  const int access = is_both ? O_RDWR : mode[0] == 'r' ? O_RDONLY : O_WRONLY;
  const int file = afterglow::test::opened(AT_FDCWD, path, access | way, 0666);
  FILE* const stream = file < 0 ? nullptr : fdopen(file, mode);
  if (file >= 0 && !stream) close(file);
  return stream;
}
FILE* fopen(const char* path, const char* mode) { return fopen64(path, mode); }

int rename(const char* path, const char* other) noexcept {
  return afterglow::test::named(afterglow::test::FileChange::Kind::Rename, path, other,
                                SYS_renameat2);
}
int link(const char* path, const char* other) noexcept {
  return afterglow::test::named(afterglow::test::FileChange::Kind::Link, path, other, SYS_linkat);
}
int unlink(const char* path) noexcept {
  return afterglow::test::named(afterglow::test::FileChange::Kind::Remove, path, nullptr,
                                SYS_unlinkat);
}
int mkdir(const char* path, mode_t mode) noexcept {
  return afterglow::test::named(afterglow::test::FileChange::Kind::MakeFolder, path, nullptr,
                                SYS_mkdirat, mode);
}
int remove(const char* path) noexcept {
  struct stat status {};
  if (lstat(path, &status) != 0) return -1;
  if (!S_ISDIR(status.st_mode)) return unlink(path);
  return afterglow::test::named(afterglow::test::FileChange::Kind::RemoveFolder, path, nullptr,
                                SYS_unlinkat, AT_REMOVEDIR);
}

}  // extern "C"

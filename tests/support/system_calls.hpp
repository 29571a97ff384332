/// \file
/// The C library's calls that take memory and that change files, in programs that are linked with
/// system_calls.cpp: one of them can be made to fail, and what they change can be listened to.
/// Syncs do not wait for the disk. For Linux with glibc; under a sanitizer, which has its own,
/// memory does not fail.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

namespace afterglow::test {

enum class CallKind {
  Memory,  ///< malloc, calloc, realloc, and so operator new
  Write,   ///< writing, truncating, making, renaming, linking and removing files
  Sync     ///< fsync, fdatasync
};

/// Counts all threads' calls of this kind from now on. The `n`-th, from 1, fails with `error`, and
/// only this one; 0: none.
void countCalls(CallKind kind, long n = 0, int error = 0);
/// Ends counting; returns how many there were.
long countedCalls();

/// While one lives, this thread's calls are not counted and do not fail: a test's own.
class UncountedCalls {
 public:
  UncountedCalls();
  UncountedCalls(const UncountedCalls&) = delete;
  UncountedCalls& operator=(const UncountedCalls&) = delete;
  ~UncountedCalls();
};

/// A change of a file or folder, as the program asked the kernel for it.
struct FileChange {
  enum class Kind { Make, Write, Truncate, Sync, Rename, Link, Remove, MakeFolder, RemoveFolder };
  Kind kind = Kind::Make;
  int descriptor = -1;      ///< of Make, Write, Truncate and Sync
  std::string path = {};    ///< of Make, Rename, Link, Remove and folders
  std::string other = {};   ///< the new name, of Rename and Link
  std::int64_t offset = 0;  ///< of Write; of Truncate the new size
  std::string bytes = {};   ///< of Write
};

/// Hears each change that succeeded, under a lock, in order.
class FileListener {
 public:
  virtual ~FileListener() = default;
  virtual void onChange(FileChange change) = 0;
};
/// Null: nobody listens.
void listenToFiles(FileListener* listener);

}  // namespace afterglow::test

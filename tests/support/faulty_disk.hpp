/// \file
/// A disk below SQLite that fails when it is told to.
#pragma once

#include <sqlite3.h>

#include <cstddef>

namespace afterglow::test {

/// While it lives, databases that are opened lie on it: SQLite's default VFS with faults in it, and
/// without waiting for the real disk. One at a time, used by one thread.
class FaultyDisk {
 public:
  enum class Fault { NoSpace, WriteError, SyncError };

  FaultyDisk();
  FaultyDisk(const FaultyDisk&) = delete;
  FaultyDisk& operator=(const FaultyDisk&) = delete;
  ~FaultyDisk();

  /// Of the operations from now on that can have this fault, the `n`-th (from 1) and all after it
  /// have it.
  void failAt(std::size_t n, Fault fault);
  void recover() { is_armed_ = false; }
  bool hasFailed() const { return has_failed_; }

 private:
  struct File;
  static FaultyDisk& of(sqlite3_file* file);
  static sqlite3_file* real(sqlite3_file* file);
  static int open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out);
  static sqlite3_io_methods forwardingMethods();
  int check(bool is_sync);

  sqlite3_vfs vfs_{};
  sqlite3_vfs* real_;
  sqlite3_io_methods methods_;
  Fault fault_ = Fault::NoSpace;
  std::size_t countdown_ = 0;
  bool is_armed_ = false, has_failed_ = false;
};

}  // namespace afterglow::test

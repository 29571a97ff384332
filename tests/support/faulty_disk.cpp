#include "tests/support/faulty_disk.hpp"

namespace afterglow::test {

/// The real file lies behind it, in the memory that SQLite gives.
struct FaultyDisk::File {
  sqlite3_file base;
  FaultyDisk* disk;
};

FaultyDisk& FaultyDisk::of(sqlite3_file* file) { return *reinterpret_cast<File*>(file)->disk; }

sqlite3_file* FaultyDisk::real(sqlite3_file* file) {
  return reinterpret_cast<sqlite3_file*>(reinterpret_cast<File*>(file) + 1);
}

FaultyDisk::FaultyDisk() : real_(sqlite3_vfs_find(nullptr)), methods_(forwardingMethods()) {
  vfs_ = *real_;  // all but opening is the real one's
  vfs_.zName = "faulty";
  vfs_.szOsFile = static_cast<int>(sizeof(File)) + real_->szOsFile;
  vfs_.xOpen = open;
  sqlite3_vfs_register(&vfs_, 1);
}

FaultyDisk::~FaultyDisk() {
  sqlite3_vfs_unregister(&vfs_);
  sqlite3_vfs_register(real_, 1);
}

void FaultyDisk::failAt(std::size_t n, Fault fault) {
  fault_ = fault;
  countdown_ = n;
  is_armed_ = true;
  has_failed_ = false;
}

int FaultyDisk::check(bool is_sync) {
  if (!is_armed_ || is_sync != (fault_ == Fault::SyncError)) return SQLITE_OK;
  if (countdown_ > 1) {
    --countdown_;
    return SQLITE_OK;
  }
  has_failed_ = true;
  if (fault_ == Fault::NoSpace) return SQLITE_FULL;
  return is_sync ? SQLITE_IOERR_FSYNC : SQLITE_IOERR_WRITE;
}

int FaultyDisk::open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out) {
  // The VFS is the first member of its disk.
  auto& disk = *reinterpret_cast<FaultyDisk*>(vfs);
  reinterpret_cast<File*>(file)->disk = &disk;
  file->pMethods = nullptr;
  const int code = disk.real_->xOpen(disk.real_, name, real(file), flags, out);
  if (code == SQLITE_OK) file->pMethods = &disk.methods_;
  return code;
}

sqlite3_io_methods FaultyDisk::forwardingMethods() {
  sqlite3_io_methods methods{};
  methods.iVersion = 3;
  methods.xClose = [](sqlite3_file* f) { return real(f)->pMethods->xClose(real(f)); };
  methods.xRead = [](sqlite3_file* f, void* to, int size, sqlite3_int64 at) {
    return real(f)->pMethods->xRead(real(f), to, size, at);
  };
  methods.xWrite = [](sqlite3_file* f, const void* from, int size, sqlite3_int64 at) {
    const int code = of(f).check(false);
    return code != SQLITE_OK ? code : real(f)->pMethods->xWrite(real(f), from, size, at);
  };
  methods.xTruncate = [](sqlite3_file* f, sqlite3_int64 size) {
    return real(f)->pMethods->xTruncate(real(f), size);
  };
  // What the kernel has outlives a process: only loss of power would need more, and it takes long.
  methods.xSync = [](sqlite3_file* f, int) { return of(f).check(true); };
  methods.xFileSize = [](sqlite3_file* f, sqlite3_int64* size) {
    return real(f)->pMethods->xFileSize(real(f), size);
  };
  methods.xLock = [](sqlite3_file* f, int kind) { return real(f)->pMethods->xLock(real(f), kind); };
  methods.xUnlock = [](sqlite3_file* f, int kind) {
    return real(f)->pMethods->xUnlock(real(f), kind);
  };
  methods.xCheckReservedLock = [](sqlite3_file* f, int* out) {
    return real(f)->pMethods->xCheckReservedLock(real(f), out);
  };
  methods.xFileControl = [](sqlite3_file* f, int what, void* argument) {
    return real(f)->pMethods->xFileControl(real(f), what, argument);
  };
  methods.xSectorSize = [](sqlite3_file* f) { return real(f)->pMethods->xSectorSize(real(f)); };
  methods.xDeviceCharacteristics = [](sqlite3_file* f) {
    return real(f)->pMethods->xDeviceCharacteristics(real(f));
  };
  methods.xShmMap = [](sqlite3_file* f, int page, int size, int extend, void volatile** out) {
    return real(f)->pMethods->xShmMap(real(f), page, size, extend, out);
  };
  methods.xShmLock = [](sqlite3_file* f, int offset, int count, int flags) {
    return real(f)->pMethods->xShmLock(real(f), offset, count, flags);
  };
  methods.xShmBarrier = [](sqlite3_file* f) { real(f)->pMethods->xShmBarrier(real(f)); };
  methods.xShmUnmap = [](sqlite3_file* f, int remove) {
    return real(f)->pMethods->xShmUnmap(real(f), remove);
  };
  methods.xFetch = [](sqlite3_file* f, sqlite3_int64 at, int size, void** out) {
    return real(f)->pMethods->xFetch(real(f), at, size, out);
  };
  methods.xUnfetch = [](sqlite3_file* f, sqlite3_int64 at, void* page) {
    return real(f)->pMethods->xUnfetch(real(f), at, page);
  };
  return methods;
}

}  // namespace afterglow::test

/// \file
/// Locks beside a store's file: which recorder has it open, which imports run. Held while the
/// object lives and gone with its process, however that ends; the locked files stay, and that they
/// are there says nothing. Readers need no lock. Internal to replay/store.
///
/// The making of files and folders, and the permissions of a store and its locks. What a robot saw
/// and said in somebody's home is its owner's: files are made 0600 and folders 0700, whatever the
/// umask. $AFTERGLOW_STORE_ACCESS asks otherwise: "group" gives 0660 and 0770, "all" 0664 and 0775.
/// What is there keeps its mode.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace afterglow::replay {

/// An open file, closed with the object; locks that were taken on it end with that.
class LockFile {
 public:
  explicit LockFile(int file) : file_(file) {}
  LockFile(LockFile&& other) noexcept;
  LockFile& operator=(LockFile&&) = delete;
  ~LockFile();
  int descriptor() const { return file_; }

 private:
  int file_;
};

/// A lock on the file PATH.lock: of several recorders one at a time writes to a store.
class RecorderLock {
 public:
  /// Throws StoreError, naming the process that holds it.
  explicit RecorderLock(const std::string& store);

 private:
  LockFile file_;
};

/// "process 4711 on fetch21" if a recorder has this store open now.
std::optional<std::string> recorderOf(const std::string& store);

/// The program of an import lives: a lock on one byte of the file PATH.imports, the one whose
/// offset is the number of the recording. Throws StoreError.
class ImportLock {
 public:
  /// Waits for a process that is about to drop an earlier recording of that number.
  ImportLock(const std::string& store, std::int64_t recording);
  /// The lock of an import whose program has died; empty if it runs, or another process drops it.
  static std::optional<ImportLock> ofDead(const std::string& store, std::int64_t recording);

 private:
  explicit ImportLock(LockFile file) : file_(std::move(file)) {}
  LockFile file_;
};

/// Returns true if the program of this import runs; takes no lock and writes nothing.
bool isImporting(const std::string& store, std::int64_t recording);

/// Makes a folder and those above it that are missing, and has the disk keep them; an empty name is
/// the current folder. Throws StoreError.
void makePrivateFolder(const std::string& folder);

/// Has the disk keep the name of a file that was made, renamed or removed, as fsync() of the file
/// need not. Returns 0 or the reason, an errno; 0 also where the file system cannot do it, or the
/// folder is not to be read.
int syncName(const std::string& path);
/// The same; throws std::filesystem::filesystem_error with the reason.
void requireSyncedName(const std::string& path);

/// The file that a path leads to through symbolic links, also where it is not there yet; the path
/// itself if it is no link.
std::string realFile(const std::string& path);

/// Makes an empty file, with the mode of the file `like`, if that is there. A descriptor of it, for
/// reading and writing; -1, with errno, if it cannot be made or is there already: a file that
/// SQLite has open must not be opened beside it, as closing that would end its locks.
int makePrivateFile(const std::string& path, const std::string& like = "");

}  // namespace afterglow::replay

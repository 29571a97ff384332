/// \file
/// Tells imports that run from imports whose program has died. Internal to replay/store.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// A lock on one byte of the file PATH.imports beside the store, that of the number of the
/// recording; held while the object lives and gone with its process, however that ends. The file
/// stays and says nothing by being there. Throws StoreError.
class ImportLock {
 public:
  /// Waits for one who is done with dropping the last recording of that number.
  ImportLock(const std::string& store, std::int64_t recording);
  /// Empty: the import runs, or somebody drops it.
  static std::optional<ImportLock> ofDead(const std::string& store, std::int64_t recording);
  ImportLock(ImportLock&& other) noexcept;
  ImportLock& operator=(ImportLock&&) = delete;
  ~ImportLock();

 private:
  explicit ImportLock(int file) : file_(file) {}
  int file_;
};

/// Numbers of the recordings whose imports were begun and not finished, dead or alive.
std::vector<std::int64_t> unfinishedImports(SqliteConnection& connection);

/// Of these, whether its program runs; takes no lock, and needs to write nothing.
bool isImporting(const std::string& store, std::int64_t recording);

}  // namespace afterglow::replay

/// \file
/// Of several recorders one at a time writes to a store's file. Internal to replay/store.
#pragma once

#include <optional>
#include <string>

namespace afterglow::replay {

/// A lock on the file PATH.lock beside the store, held while the object lives and gone with its
/// process, however that ends: the file stays and says nothing by being there. Readers and
/// importers do not care for it.
class RecorderLock {
 public:
  /// Throws StoreError, naming the process that holds it.
  explicit RecorderLock(const std::string& store);
  RecorderLock(const RecorderLock&) = delete;
  RecorderLock& operator=(const RecorderLock&) = delete;
  ~RecorderLock();

 private:
  int file_;
};

/// "process 4711 on fetch21" if a recorder has this store open now.
std::optional<std::string> recorderOf(const std::string& store);

}  // namespace afterglow::replay

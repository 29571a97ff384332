/// \file
/// Rosbags (format 2.0, plain, bz2 or lz4) into a store and out of one. Needs rosbag_storage; built
/// without it, all functions throw BagError saying so.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// A bag cannot be read or written; the text names the file, where in it, and why.
class BagError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Called now and then with how many messages of how many are through.
using BagProgress = std::function<void(std::uint64_t done, std::uint64_t total)>;

struct BagImport {
  std::string name;  ///< of the behavior; empty: the file's name without ".bag"
  std::vector<std::string> tags;
  BagProgress progress;
};

struct BagImportResult {
  Behavior behavior;
  std::uint64_t messages = 0;
  /// Messages that rosbag's own reader leaves out: their stamp is zero.
  std::uint64_t unstamped = 0;
};

/// Bags as one recording and, over it, one behavior with outcome "imported" on all their topics.
/// Order: the bags' stamps, then the bags by their first stamps, then position in the file, which
/// is the order they were recorded in. Others may write meanwhile; the behavior is there when all
/// of it is. Throws BagError or StoreError and leaves the store as it was; what an import leaves
/// that is killed, nobody finds, and the next one drops (Store::beginImport()).
BagImportResult importBags(const std::vector<std::string>& paths, Store& store,
                           const BagImport& import = {});

inline BagImportResult importBag(const std::string& path, Store& store,
                                 const BagImport& import = {}) {
  return importBags({path}, store, import);
}

enum class BagCompression { None, Bz2, Lz4 };

struct BagExport {
  BagCompression compression = BagCompression::None;
  /// A bag that has about reached this is followed by another: F.bag becomes F_0.bag, F_1.bag, ...
  std::optional<std::uint64_t> split_bytes;
  BagProgress progress;
};

struct BagExportResult {
  std::uint64_t messages = 0;
  std::uint64_t damaged = 0;       ///< messages that the store could not give back
  std::vector<std::string> paths;  ///< of the bags, in order
};

/// Messages of behaviors (MessageRange's rules) as a bag that rosbag reads: bytes, stamps, order,
/// definitions, latching and caller id as they were recorded; a message that several behaviors
/// cover is in it once. Written beside `path` and renamed when complete. Throws BagError or
/// StoreError; `path` is then as it was.
BagExportResult exportBags(const Store& store, const std::vector<Behavior>& behaviors,
                           const MessageRange& range, const std::string& path,
                           const BagExport& options = {});

/// One behavior as one bag; returns how many messages.
inline std::uint64_t exportBag(const Store& store, const Behavior& behavior,
                               const MessageRange& range, const std::string& path) {
  return exportBags(store, {behavior}, range, path).messages;
}

}  // namespace afterglow::replay

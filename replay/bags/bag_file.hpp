/// \file
/// Rosbags (format 2.0, plain, bz2 or lz4) into a store and out of one. Needs rosbag_storage; built
/// without it, both functions throw BagError saying so.
#pragma once

#include <cstdint>
#include <functional>
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

/// The whole bag as one recording and, over it, one behavior with outcome "imported" on all its
/// topics. Order: the bag's stamps, then position in the file, which is the order they were
/// recorded in. One transaction: throws BagError or StoreError and leaves the store as it was.
BagImportResult importBag(const std::string& path, Store& store, const BagImport& import = {});

/// Messages of a behavior (MessageRange's rules) as a bag that rosbag reads: bytes, stamps, order,
/// definitions, latching and caller id as they were recorded. Written beside `path` and renamed
/// when complete. Returns how many messages. Throws BagError or StoreError; `path` is then as it
/// was.
std::uint64_t exportBag(const Store& store, const Behavior& behavior, const MessageRange& range,
                        const std::string& path, const BagProgress& progress = {});

}  // namespace afterglow::replay

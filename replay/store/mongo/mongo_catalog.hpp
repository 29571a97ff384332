/// \file
/// The recordings and channels of a MongoDB store (mongo_layout.hpp), and a transaction on a server
/// that has none. Internal to replay/store.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "replay/store/mongo/mongo_client.hpp"
#include "replay/store/mongo/mongo_layout.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Writes take effect at once; each says how it is taken back, should the transaction fail. Used
/// under the lock of the store that writes.
class UndoLog {
 public:
  /// Runs `work`. When it throws, its writes are taken back, the last one first, and the exception
  /// goes on; what cannot be taken back stays. A transaction within another is a part of that one.
  void transaction(const std::function<void()>& work) {
    if (is_running_) return work();
    is_running_ = true;
    try {
      work();
    } catch (...) {
      takeBack();
      finish();
      throw;
    }
    for (const auto& rest : finish()) rest();
  }
  bool isRunning() const { return is_running_; }
  /// Takes back the write that was just made, if it is part of a transaction that fails.
  void onFailure(std::function<void()> undo) {
    if (is_running_) on_failure_.push_back(std::move(undo));
  }
  /// Called when the transaction has succeeded; at once outside of one.
  void onSuccess(std::function<void()> rest) {
    if (!is_running_) return rest();
    on_success_.push_back(std::move(rest));
  }

 private:
  void takeBack() const noexcept {
    for (auto undo = on_failure_.rbegin(); undo != on_failure_.rend(); ++undo) {
      try {
        (*undo)();
      } catch (const StoreError&) {  // the first error is the one to tell
      }
    }
  }
  std::vector<std::function<void()>> finish() {
    is_running_ = false;
    on_failure_.clear();
    return std::exchange(on_success_, {});
  }

  bool is_running_ = false;
  std::vector<std::function<void()>> on_failure_, on_success_;
};

/// Remembers the entries that it has read: they never change. Throws StoreError, also for a number
/// that there is not. Reading: any thread; writing: one thread at a time. Client and log must
/// outlive it.
/// The server cannot ask whether an importing program still runs: its recording holds a lease
/// (import_until) that the program renews.
class MongoCatalog {
 public:
  using ChannelPtr = std::shared_ptr<const MongoChannel>;

  MongoCatalog(const MongoClient& client, std::string database, UndoLog& undo)
      : client_(client), database_(std::move(database)), undo_(undo) {}

  void makeIndexes() const;
  /// The number of the recording with this key; a new one if the key is empty or unknown.
  std::int64_t addRecording(const Recording& recording);
  std::int64_t addChannel(std::int64_t recording, const Channel& channel);
  /// Removes a recording with its channels.
  void removeRecording(std::int64_t id);

  void beginImport(std::int64_t recording);
  /// Renews the lease now and then, if the import is this object's; called with every append to
  /// this channel.
  void renewImport(std::int64_t channel);
  void finishImport(std::int64_t recording);
  /// The recordings whose lease has run out.
  std::vector<std::int64_t> deadImports() const;

  std::vector<Recording> recordings() const;  ///< recordings by number
  Recording recording(std::int64_t id) const;
  ChannelPtr channel(std::int64_t id) const;
  std::vector<ChannelPtr> channelsOf(std::int64_t recording) const;
  /// The collections in which messages of a recording can be.
  std::set<std::string> collectionsOf(std::int64_t recording) const;

 private:
  std::int64_t findOrInsert(const std::string& collection, const Bson& key, const Bson& rest);
  void forget(std::int64_t id);
  void lease(std::int64_t recording) const;
  std::string definitionId(const Channel& channel);
  ChannelPtr readChannel(const bson_t& document) const;

  const MongoClient& client_;
  const std::string database_;
  UndoLog& undo_;
  /// The imports of this object, and when their leases were renewed last.
  std::map<std::int64_t, std::chrono::steady_clock::time_point> imports_;
  mutable std::mutex mutex_;  ///< guards the two maps
  mutable std::map<std::int64_t, Recording> recordings_;
  mutable std::map<std::int64_t, ChannelPtr> channels_;
};

}  // namespace afterglow::replay

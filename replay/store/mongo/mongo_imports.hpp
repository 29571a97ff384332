/// \file
/// The imports under way into a MongoDB store. Internal to replay/store.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "replay/store/mongo/mongo_client.hpp"
#include "replay/store/mongo/undo_log.hpp"

namespace afterglow::replay {

/// The server cannot ask whether a program still runs: a recording that is imported holds a lease
/// (import_until, mongo_layout.hpp), which the importing program renews. Used under the lock of the
/// store; throws StoreError. Client and log must outlive it.
class MongoImports {
 public:
  MongoImports(const MongoClient& client, std::string database, UndoLog& undo)
      : client_(client), database_(std::move(database)), undo_(undo) {}

  void begin(std::int64_t recording);
  bool empty() const { return renewed_.empty(); }
  /// To be called with every append: renews the lease now and then, if this import is ours.
  void renew(std::int64_t recording);
  void finish(std::int64_t recording);
  void forget(std::int64_t recording) { renewed_.erase(recording); }
  /// The recordings whose lease has run out.
  std::vector<std::int64_t> dead() const;

 private:
  void lease(std::int64_t recording) const;

  const MongoClient& client_;
  const std::string database_;
  UndoLog& undo_;
  /// The imports of this object, and when their leases were renewed last.
  std::map<std::int64_t, std::chrono::steady_clock::time_point> renewed_;
};

}  // namespace afterglow::replay

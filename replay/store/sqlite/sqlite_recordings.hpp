/// \file
/// The recordings of a SQLite store and the channels in them. Internal to replay/store.
#pragma once

#include <map>
#include <vector>

#include "replay/store/sqlite/sqlite.hpp"

namespace afterglow::replay {

/// Throws StoreError. The connection must outlive it.
class SqliteRecordings {
 public:
  explicit SqliteRecordings(SqliteConnection& connection) : connection_(connection) {}

  /// Does what Store::addRecording() and so on do.
  std::int64_t add(const Recording& recording);
  std::vector<Recording> all() const;
  std::int64_t addChannel(std::int64_t recording, const Channel& channel);
  Channel channel(std::int64_t id) const;

  void require(std::int64_t recording) const;
  bool hasBehaviors(std::int64_t recording) const;
  std::int64_t ofChannel(std::int64_t channel);
  /// Removes the rows of a recording, its channels, and definitions that no channel uses any more.
  /// In the transaction that is open; the recording has no messages and behaviors.
  void remove(std::int64_t recording);
  /// Forgets ids that may be given out again: a transaction was undone, a recording removed.
  void forget() { of_channel_.clear(); }

 private:
  std::int64_t definitionId(const Channel& channel);

  SqliteConnection& connection_;
  std::map<std::int64_t, std::int64_t> of_channel_;  ///< recordings by channel
};

}  // namespace afterglow::replay

/// \file
/// The index of the console: all behaviors and what was said in them, in memory. Requests never
/// wait for the store.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "nodes/behavior_view/behavior_story.hpp"
#include "replay/clock/worker_thread.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct IndexedBehavior : BehaviorSummary {
  std::string searched;  ///< foldedText() of all that a search looks at
};

/// Newest first (by begin, then id).
using IndexedBehaviors = std::vector<std::shared_ptr<const IndexedBehavior>>;

/// Reads the store, once begun in a thread of its own: first all of it, the newest behaviors first,
/// then every second what has changed. A behavior that is not read yet is found by its own fields.
class BehaviorIndex {
 public:
  /// The store has to outlive it. It is not opened a second time: of a file that a process opens
  /// twice, it may lose its locks (fcntl), and then sees no more what others write.
  explicit BehaviorIndex(const replay::Store& store);

  void begin() { thread_.begin(); }
  /// Reads what has changed: for who has not begun.
  void read();

  /// Returns all, as they were a second ago at most, or longer while the store cannot be read.
  std::shared_ptr<const IndexedBehaviors> all() const;
  /// Null if there is none of that id.
  std::shared_ptr<const IndexedBehavior> find(std::int64_t id) const;
  /// Returns why the store could not be read the last time, a line; empty: it was read.
  std::string problem() const;

 private:
  using Known = std::map<std::int64_t, std::shared_ptr<const IndexedBehavior>>;

  void readAll();
  void readMessages(const std::vector<replay::Behavior>& behaviors);
  void publish(const std::vector<replay::Behavior>& order);

  const replay::Store& store_;
  Known known_;                            ///< of the thread
  std::map<std::int64_t, bool> is_heard_;  ///< the thread's: messages that have been read

  mutable std::mutex mutex_;
  std::shared_ptr<const IndexedBehaviors> all_;
  std::string problem_;
  replay::RepeatingThread thread_;
};

/// Reads details and keeps the last ones, as long as their behaviors are what they were. Any
/// thread; both have to outlive it.
class BehaviorDetails {
 public:
  BehaviorDetails(const replay::Store& store, const BehaviorIndex& index)
      : store_(store), index_(index) {}

  /// Null if there is no behavior of that id. Throws replay::StoreError.
  std::shared_ptr<const BehaviorDetail> find(std::int64_t id);

 private:
  const replay::Store& store_;
  const BehaviorIndex& index_;
  std::mutex mutex_;
  std::list<std::shared_ptr<const BehaviorDetail>> kept_;  ///< the last used first
};

}  // namespace afterglow::nodes

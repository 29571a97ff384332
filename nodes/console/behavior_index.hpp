/// \file
/// The index of the console: all behaviors and what was said in them, in memory. Requests never
/// wait for the store.
///
/// Finding behaviors as one types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
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

struct BehaviorSearch {
  /// Words that all have to occur, capitals and accents aside, in name, outcome, tags, tree path,
  /// robot, parameters, notes or what was said. "name:pick", "outcome:", "tag:", "tree:", "robot:",
  /// "said:", "note:" and "parameter:" look there alone; "id:7" is one.
  std::string words;
  std::string name, outcome;                      ///< exactly; empty: any
  std::optional<replay::Stamp> from, to;          ///< end after, begin before
  std::optional<std::set<std::int64_t>> of_these; ///< ids
  std::optional<std::int64_t> before;             ///< only those that come after this id
  std::size_t limit = 100;
};

struct FoundBehaviors {
  std::size_t matching = 0;  ///< all, whatever `before` and `limit` say
  IndexedBehaviors behaviors;
};

FoundBehaviors searchBehaviors(const IndexedBehaviors& all, const BehaviorSearch& search);

/// Returns the text as a search compares it: in small letters and without accents, as far as Latin,
/// Greek and Cyrillic go. Bytes that are no UTF-8 are left out.
std::string foldedText(const std::string& text);
/// Returns all that a search looks at, folded.
std::string searchedText(const BehaviorSummary& one);

}  // namespace afterglow::nodes

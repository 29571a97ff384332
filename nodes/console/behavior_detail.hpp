/// \file
/// All that the console shows of one behavior, read from the store.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "nodes/console/behavior_index.hpp"
#include "nodes/console/behavior_story.hpp"
#include "nodes/console/topic_lanes.hpp"

namespace afterglow::nodes {

struct BehaviorDetail {
  std::shared_ptr<const IndexedBehavior> one;
  replay::Behavior behavior;  ///< all of it
  std::vector<TopicLane> lanes;
  ToldStory story;
  IndexedBehaviors children;  ///< newest first
  IndexedBehaviors attempts;  ///< others of this name and tree path under the same parent
};

/// Reads details and keeps the last ones, as long as their behaviors are what they were. Any
/// thread; both have to outlive it.
class BehaviorDetails {
 public:
  BehaviorDetails(const replay::Store& store, const BehaviorIndex& index)
      : store_(store), index_(index) {}

  /// Throws HttpError 404 if there is no behavior of that id, and replay::StoreError.
  std::shared_ptr<const BehaviorDetail> of(std::int64_t id);

 private:
  const replay::Store& store_;
  const BehaviorIndex& index_;
  std::mutex mutex_;
  std::list<std::shared_ptr<const BehaviorDetail>> kept_;  ///< the last used first
};

}  // namespace afterglow::nodes

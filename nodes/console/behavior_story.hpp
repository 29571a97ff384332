/// \file
/// A behavior in words, made from what was recorded.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nodes/console/behavior_index.hpp"
#include "nodes/console/topic_lanes.hpp"

namespace afterglow::nodes {

struct StoryEntry {
  double t = 0;               ///< seconds since the behavior's begin
  std::string clock;          ///< "12:03:20", local time
  std::string kind;           ///< "began", "said", "goal", "child", "ended", "remark"
  std::string text;           ///< one sentence
  std::string subject;        ///< the text without times and numbers: what two stories share
  std::int64_t behavior = 0;  ///< of a child
  bool is_bad = false;        ///< a failure
};

struct ToldStory {
  std::vector<StoryEntry> entries;  ///< in their order
  std::vector<double> key_moments;  ///< at most 6, which pictures should show
};

/// `children`: in any order.
ToldStory tellStory(const IndexedBehavior& one, const std::vector<TopicLane>& lanes,
                        const IndexedBehaviors& children);

/// "12:03:20", local time, of a moment of the behavior.
std::string clockText(const replay::Behavior& behavior, double t);

}  // namespace afterglow::nodes

/// \file
/// What a behavior holds, topic by topic, over its time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nodes/console/goal_spans.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct TopicLane {
  std::string topic, type;
  std::uint64_t count = 0;
  std::optional<double> hz;    ///< empty for a single message
  double first = 0, last = 0;  ///< seconds since the behavior's begin, as all times here
  /// "body", "ar", "speech"; "control", "endless" motion; "state", "other".
  std::string role;
  bool is_context = false;    ///< of the recording, not of the behavior itself
  std::string why_not;        ///< why a replay would leave it out; empty: it is replayed
  std::vector<double> marks;  ///< when messages came; of many some
  std::vector<GoalSpan> spans;
};

constexpr std::size_t kMostMarks = 400;

/// Own topics first, then the context's. Reads a bounded number of messages, however many there
/// are: of topics with many the first after each of 100 moments. Throws replay::StoreError.
std::vector<TopicLane> topicLanes(const replay::Store& store, const replay::Behavior& behavior);

}  // namespace afterglow::nodes

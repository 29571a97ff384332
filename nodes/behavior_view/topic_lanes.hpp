/// \file
/// The messages of a behavior over its time, topic by topic, and its goals.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// A goal of an action, from being sent to its result.
struct GoalSpan {
  std::string topic;         ///< the goal's
  double from = 0;           ///< seconds since the behavior's begin
  std::optional<double> to;  ///< empty: no result was recorded
  std::string outcome;       ///< "succeeded", "aborted" ...; empty without a result
  std::string remark;        ///< words of its server, a line
  std::string within;        ///< the action of a longer goal around it, which may have sent it
  int number = 1;            ///< counted from 1 on its topic
};

struct TopicLane {
  std::string topic, type;
  std::uint64_t count = 0;
  std::optional<double> hz;    ///< empty for a single message
  double first = 0, last = 0;  ///< seconds since the behavior's begin, as all times here
  /// "body", "ar", "speech"; "control", "endless" motion; "state", "other".
  std::string role;
  bool is_context = false;    ///< true: the recording's, not the behavior's own
  std::string why_not;        ///< reason for a replay to leave it out; empty: it is replayed
  std::vector<double> marks;  ///< times of messages; of many some
  std::vector<GoalSpan> spans;
};

constexpr std::size_t kMostMarks = 400;

/// Own topics first, then the context's. Reads a bounded number of messages, however many there
/// are: of topics with many the first after each of 100 moments. Throws replay::StoreError.
std::vector<TopicLane> topicLanes(const replay::Store& store, const replay::Behavior& behavior);

/// Returns the name of an action by the topic of its goals:
/// "arm_controller/follow_joint_trajectory".
std::string actionName(const std::string& goal_topic);

}  // namespace afterglow::nodes

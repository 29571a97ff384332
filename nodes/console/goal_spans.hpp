/// \file
/// The goals of a behavior's actions, from being sent to their results.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct GoalSpan {
  std::string topic;         ///< of the goal
  double from = 0;           ///< seconds since the behavior's begin
  std::optional<double> to;  ///< empty: no result was recorded
  std::string outcome;       ///< "succeeded", "aborted" ...; empty without a result
  std::string remark;        ///< what its server said, one line
  std::string within;        ///< the action of a longer goal around it, which may have sent it
  int number = 1;            ///< counted from 1 on its topic
};

/// "arm_controller/follow_joint_trajectory" of its goals' topic.
std::string actionName(const std::string& goal_topic);

/// Ordered by their begin; at most 500 of a topic. Results are those of the recording, whether they
/// are the behavior's own or not. Goals that cannot be read are left out. Throws
/// replay::StoreError.
std::vector<GoalSpan> goalSpans(const replay::Store& store, const replay::Behavior& behavior,
                                const std::vector<replay::TopicSummary>& topics);

}  // namespace afterglow::nodes

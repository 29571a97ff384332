/// \file
/// The recorder's two actions in terms of RecordingManager: record_behavior, and mongodb_logger as
/// the paper's code calls it (robot-behavior-replay, server/mongodb_logger_action_server.py).
#pragma once

#include <afterglow/RecordBehaviorAction.h>
#include <mongodb/MongoDBLoggerAction.h>

#include "nodes/recorder/recording_manager.hpp"

namespace afterglow::nodes {

struct RecordBehaviorTranslation {
  static RecordingRequest request(const RecordBehaviorGoal& goal) { return toRequest(goal); }
  static RecordBehaviorFeedback feedback(std::int64_t id, const replay::RecordedCounts& counts);
  static RecordBehaviorResult result(std::int64_t id, const RecordingManager::Ended& ended);
};

/// Topics joined by ':'. Feedback is how many messages there are (the original sends the text of
/// them all, again every second); the result the topics that were heard, joined as in the goal.
struct MongoDBLoggerTranslation {
  static RecordingRequest request(const mongodb::MongoDBLoggerGoal& goal);
  static mongodb::MongoDBLoggerFeedback feedback(std::int64_t id,
                                                 const replay::RecordedCounts& counts);
  static mongodb::MongoDBLoggerResult result(std::int64_t id, const RecordingManager::Ended& ended);
};

}  // namespace afterglow::nodes

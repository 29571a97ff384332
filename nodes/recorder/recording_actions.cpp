#include "nodes/recorder/recording_actions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "replay/messages/text.hpp"

namespace afterglow::nodes {

RecordBehaviorFeedback RecordBehaviorTranslation::feedback(std::int64_t id,
                                                           const replay::RecordedCounts& counts) {
  RecordBehaviorFeedback feedback;
  feedback.behavior_id = id;
  feedback.messages = counts.stored;
  feedback.dropped = counts.dropped;
  feedback.remarks = counts.remarks;
  return feedback;
}

RecordBehaviorResult RecordBehaviorTranslation::result(std::int64_t id,
                                                       const RecordingManager::Ended& ended) {
  RecordBehaviorResult result;
  result.behavior_id = id;
  result.outcome = ended.outcome;
  result.messages = ended.counts.stored;
  result.dropped = ended.counts.dropped;
  result.silent_topics = ended.counts.silent_topics;
  result.kept = ended.kept;
  result.remarks = ended.counts.remarks;
  return result;
}

RecordingRequest MongoDBLoggerTranslation::request(const mongodb::MongoDBLoggerGoal& goal) {
  RecordingRequest request;
  request.behavior.name = "mongodb_logger";
  for (const std::string& name : replay::splitAt(':', goal.topics.data)) {
    // The original resolves names as rostopic does.
    request.behavior.topics.push_back(name.front() == '/' ? name : "/" + name);
  }
  if (request.behavior.topics.empty()) {
    throw std::invalid_argument("no topics are named; expected '/a:/b'");
  }
  request.behavior = checkedBehavior(std::move(request.behavior));
  return request;
}

mongodb::MongoDBLoggerFeedback MongoDBLoggerTranslation::feedback(
    std::int64_t id, const replay::RecordedCounts& counts) {
  mongodb::MongoDBLoggerFeedback feedback;
  feedback.msgs_received.data = "behavior " + std::to_string(id) + ": " +
                                std::to_string(counts.stored) + " messages stored, " +
                                std::to_string(counts.dropped) + " dropped";
  return feedback;
}

mongodb::MongoDBLoggerResult MongoDBLoggerTranslation::result(
    std::int64_t, const RecordingManager::Ended& ended) {
  mongodb::MongoDBLoggerResult result;
  const std::vector<std::string>& silent = ended.counts.silent_topics;
  std::vector<std::string> logged;
  std::copy_if(ended.topics.begin(), ended.topics.end(), std::back_inserter(logged),
               [&silent](const std::string& topic) {
                 return std::find(silent.begin(), silent.end(), topic) == silent.end();
               });
  result.topics_logged.data = fmt::format("{}", fmt::join(logged, ":"));
  return result;
}

}  // namespace afterglow::nodes

/// \file
/// A caller's request to record, checked before anything is done.
#pragma once

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "replay/record/recorder.hpp"
#include "replay/record/topic_choice.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct RecordingRequest {
  replay::Behavior behavior;  ///< its topics: those that are named
  replay::TopicChoice choice;
  replay::RecordingTerms terms;
  /// Outcomes with which it is kept; empty: with any. An outcome that nobody chose (the recorder
  /// was stopped, the disk is full) is always kept.
  std::set<std::string> keep_if;
};

/// Throws std::invalid_argument, one line, for an empty name, a topic name that is relative or
/// malformed, parameters that are no JSON object. Topics named twice count once, a trailing slash
/// is dropped.
replay::Behavior checkedBehavior(replay::Behavior asked);

/// The words of a list like "failure, aborted".
std::set<std::string> outcomes(const std::string& list);

/// From a RecordBehavior goal or a StartRecording request, which have the same fields. Throws
/// std::invalid_argument for whatever cannot be recorded, or names no topic.
template <class Message>
RecordingRequest toRequest(const Message& message) {
  RecordingRequest request;
  replay::Behavior& behavior = request.behavior;
  behavior.name = message.name;
  behavior.topics = message.topics;
  behavior.tree_path = message.tree_path;
  behavior.parameters = message.parameters;
  behavior.tags = message.tags;
  behavior.attempt = std::max(0, message.attempt);
  behavior = checkedBehavior(std::move(behavior));
  request.choice = {message.regexes, message.exclude, static_cast<bool>(message.all)};
  if (behavior.topics.empty() && !request.choice.isOpen()) {
    throw std::invalid_argument("no topics are named");
  }
  for (const std::string& limit : message.limits) {
    request.terms.limits.push_back(replay::TopicLimit::parse(limit));
  }
  if (!(message.pre_roll >= 0 && message.pre_roll <= 3600)) {
    throw std::invalid_argument("pre_roll must be 0 to 3600 seconds");
  }
  request.terms.pre_roll_ns = std::llround(message.pre_roll * 1e9);
  request.keep_if = outcomes(message.keep_if);
  return request;
}

}  // namespace afterglow::nodes

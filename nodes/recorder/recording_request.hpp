/// \file
/// A caller's request to record, checked before anything is done.
#pragma once

#include <set>
#include <string>

#include "nodes/behavior_trees/include/afterglow/recorder_client.hpp"
#include "replay/record/recorder.hpp"
#include "replay/record/topic_choice.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

struct RecordingRequest {
  replay::Behavior behavior;  ///< behavior; its topics are those that are named
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

/// Throws std::invalid_argument for whatever cannot be recorded, or names no topic.
RecordingRequest checkedRequest(const RecordingOptions& asked);

/// Reads a RecordBehavior goal or a StartRecording request, which have the same fields.
template <class Message>
RecordingRequest toRequest(const Message& message) {
  RecordingOptions asked;
  copyRecordingFields(message, asked);
  return checkedRequest(asked);
}

}  // namespace afterglow::nodes

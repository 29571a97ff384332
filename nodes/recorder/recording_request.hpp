/// \file
/// What a caller asks the recorder for, checked before anything is touched.
#pragma once

#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

/// Throws std::invalid_argument, one line, for an empty name, no topics, a topic name that is
/// relative or malformed, parameters that are no JSON object. Topics named twice count once, a
/// trailing slash is dropped.
replay::Behavior checkedBehavior(replay::Behavior asked);

/// From a RecordBehavior goal or a StartRecording request, which have the same fields.
template <class Request>
replay::Behavior toBehavior(const Request& request) {
  replay::Behavior behavior;
  behavior.name = request.name;
  behavior.topics = request.topics;
  behavior.tree_path = request.tree_path;
  behavior.parameters = request.parameters;
  behavior.tags = request.tags;
  behavior.attempt = request.attempt;
  return checkedBehavior(std::move(behavior));
}

}  // namespace afterglow::nodes

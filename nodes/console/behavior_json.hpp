/// \file
/// Behaviors as the API gives them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "nodes/behavior_view/behavior_story.hpp"
#include "nodes/console/http_message.hpp"

namespace afterglow::nodes {

/// {id, name, outcome, look, begin, end, duration, said, tags, tree_path, attempt, parent, robot,
/// notes, remarks, messages, parameters}. Stamps are nanoseconds as strings: JavaScript's numbers are too
/// small. `end` is null while it runs.
nlohmann::ordered_json behaviorJson(const BehaviorSummary& one);

/// behaviorJson() and {story, lanes, said, children, attempts, key_moments}.
nlohmann::ordered_json detailJson(const BehaviorDetail& detail);

/// {a, b, duration, topics, parameters, story} of two behaviors; parameters and topics are those of
/// either, each with `differs`.
nlohmann::ordered_json comparisonJson(const BehaviorDetail& a, const BehaviorDetail& b);

std::string stampText(replay::Stamp stamp);

/// 200, as JSON; strings that are no UTF-8 have U+FFFD for each bad byte.
HttpResponse jsonResponse(const nlohmann::ordered_json& json);

}  // namespace afterglow::nodes

/// \file
/// Behaviors as the API gives them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "nodes/console/behavior_index.hpp"

namespace afterglow::nodes {

/// {id, name, outcome, begin, end, duration, said, tags, tree_path, attempt, parent, robot, notes,
/// remarks, messages, parameters}. Stamps are nanoseconds as strings: JavaScript's numbers are too
/// small. `end` is null while it runs.
nlohmann::ordered_json behaviorJson(const IndexedBehavior& one);

std::string stampText(replay::Stamp stamp);

/// 200, as JSON; strings that are no UTF-8 have U+FFFD for each bad byte.
struct HttpResponse jsonResponse(const nlohmann::ordered_json& json);

}  // namespace afterglow::nodes

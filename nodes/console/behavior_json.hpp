/// \file
/// Behaviors as the API gives them.
///
/// The numbers that a topic's messages hold, over time, for a plot.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nodes/behavior_view/behavior_story.hpp"
#include "nodes/console/http_message.hpp"
#include "replay/store/store.hpp"

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

struct TopicValues {
  std::vector<double> t;  ///< seconds since the behavior's begin, ascending
  /// By path ("linear.x", "position[3]"): a number for each of `t`; NaN where a message has none.
  std::map<std::string, std::vector<double>> fields;
  bool is_whole = true;  ///< false: of many messages some, or of many fields the first
};

/// Reads what a topic, a behavior's own or one of its context, said from `from` to `to`, seconds:
/// all messages where they are few, else some hundreds, evenly. Messages that cannot be read are
/// left out, as are headers and long arrays. Throws replay::StoreError.
TopicValues topicValues(const replay::Store& store, const replay::Behavior& behavior,
                        const std::string& topic, double from, double to);

}  // namespace afterglow::nodes

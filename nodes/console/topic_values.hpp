/// \file
/// The numbers that a topic's messages hold, over time, for a plot.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

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

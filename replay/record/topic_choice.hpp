/// \file
/// The topics that a recording takes: by name, by pattern, all.
#pragma once

#include <string>
#include <vector>

#include "replay/query/regular_expression.hpp"

namespace afterglow::replay {

/// Names count whatever else is said. Regular expressions (Perl's) have to match a whole name,
/// as rosbag's do. `all` leaves out /clock, which a replay gives anew, and /rosout and
/// /rosout_agg, as mongodb_log does. Exclusions hold for patterns and `all`. A
/// name on which an expression takes too long is not taken.
class TopicChoice {
 public:
  TopicChoice() = default;
  /// Throws std::invalid_argument, one line, for a pattern that is no regular expression.
  TopicChoice(const std::vector<std::string>& regexes, const std::vector<std::string>& exclude,
              bool all);

  /// Returns true if topics may join that are not named.
  bool isOpen() const { return all_ || !regexes_.empty(); }
  /// Returns true if a pattern or `all` takes this topic.
  bool matches(const std::string& topic) const;

 private:
  std::vector<RegularExpression> regexes_, exclude_;
  bool all_ = false;
};

}  // namespace afterglow::replay

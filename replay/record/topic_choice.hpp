/// \file
/// The topics that a recording takes: by name, by pattern, all; and how often: every n-th message,
/// or so many a second.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
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

/// "/scan every=5", "/camera/points max_hz=2", or both.
struct TopicLimit {
  std::string topic;
  std::uint64_t every = 1;  ///< the first and every so many-th after it
  double max_hz = 0;        ///< 0: any
  /// Throws std::invalid_argument, one line, that quotes the text.
  static TopicLimit parse(const std::string& text);
  std::string str() const;  ///< text: "every=5", "max_hz=2", "every=5 max_hz=2"
};

/// Judges the messages of one topic in the order of arrival. With max_hz those are kept that come
/// closest after each 1/max_hz, so that the mean rate does not fall below it by rounding.
class TopicThinner {
 public:
  explicit TopicThinner(TopicLimit limit) : limit_(std::move(limit)) {}
  bool keeps(Stamp received);
  const TopicLimit& limit() const { return limit_; }
  std::uint64_t seen() const { return seen_; }
  std::uint64_t leftOut() const { return left_out_; }

 private:
  bool isDue(Stamp received);

  TopicLimit limit_;
  std::uint64_t seen_ = 0, left_out_ = 0;
  Stamp due_;
};

}  // namespace afterglow::replay

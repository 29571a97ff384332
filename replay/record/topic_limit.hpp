/// \file
/// Fewer messages of a topic than there are: every n-th, or so many a second.
#pragma once

#include <cstdint>
#include <string>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

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

/// \file
/// The lag of a consumer of the replayed messages.
#pragma once

#include <cstdint>
#include <deque>
#include <utility>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

/// A consumer's own messages tell how far it has come, by their header stamps. The replay shifts
/// stamps by another amount after every pause, seek and change of rate: so a stamp is looked up
/// among the moments of publishing. A value; not thread-safe. Source of the
/// semantics: rosbag play's --rate-control-topic.
class ConsumerLag {
 public:
  /// `has_recorded_time`: stamps are recorded ones.
  ConsumerLag(double longest_s, Stamp begin, bool has_recorded_time);

  /// A message of this recorded moment went out. Back in time, the consumer has that to come.
  void onPublished(Stamp recorded, Stamp ros_now);
  void onAnswer(Stamp header);
  /// Returns true if the last published stamp is further than the longest lag ahead of the last
  /// answered one.
  bool isBehind() const { return published_.ns - answered_.ns > longest_ns_; }

 private:
  Stamp recordedAt(Stamp ros) const;

  std::int64_t longest_ns_;
  bool has_recorded_time_;
  Stamp published_, answered_;
  std::deque<std::pair<Stamp, Stamp>> moments_;  ///< ROS time, recorded; both rise
};

}  // namespace afterglow::replay

/// \file
/// ROS messages as bytes, with everything that is needed to publish them again or to read their
/// fields. Needs no ROS header.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace afterglow::replay {

/// A point in ROS time: nanoseconds since the epoch (of the wall clock, or of a simulation).
struct Stamp {
  std::int64_t ns = 0;

  static constexpr Stamp fromParts(std::uint32_t sec, std::uint32_t nsec) {
    return {static_cast<std::int64_t>(sec) * 1'000'000'000 + nsec};
  }
  friend constexpr bool operator==(Stamp a, Stamp b) { return a.ns == b.ns; }
  friend constexpr bool operator!=(Stamp a, Stamp b) { return a.ns != b.ns; }
  friend constexpr bool operator<(Stamp a, Stamp b) { return a.ns < b.ns; }
  friend constexpr bool operator<=(Stamp a, Stamp b) { return a.ns <= b.ns; }
  friend constexpr bool operator>(Stamp a, Stamp b) { return a.ns > b.ns; }
  friend constexpr bool operator>=(Stamp a, Stamp b) { return a.ns >= b.ns; }
};

using Bytes = std::vector<std::uint8_t>;

/// A publisher's connection on one topic, as its connection header describes it.
struct Channel {
  std::string topic;       ///< absolute name
  std::string type;        ///< e.g. "sensor_msgs/PointCloud2"
  std::string md5;         ///< 32 hex digits
  std::string definition;  ///< full text, with the definitions of all contained types
  bool latching = false;
  std::string caller_id;  ///< name of the publishing node; empty if unknown

  friend bool operator==(const Channel& a, const Channel& b) {
    return a.topic == b.topic && a.type == b.type && a.md5 == b.md5 &&
           a.definition == b.definition && a.latching == b.latching && a.caller_id == b.caller_id;
  }
};

/// A serialized message of a channel.
struct Message {
  std::int64_t channel = 0;  ///< the store's id of its Channel
  Stamp received;            ///< ROS time of arrival
  /// The order of arrival, unique within one recording; it orders messages of equal stamps.
  std::uint64_t sequence = 0;
  std::optional<Stamp> header_stamp;  ///< the message's own header.stamp, if it has a header
  Bytes bytes;
};

}  // namespace afterglow::replay

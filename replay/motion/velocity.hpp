/// \file
/// The velocity that a geometry_msgs/Twist or TwistStamped commands, in its bytes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "replay/messages/message.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {

/// A base that hears nothing stops after so long (0.25 s on a Fetch).
constexpr std::int64_t kVelocityHoldsNs = 250'000'000;

using Velocity = std::array<double, 6>;  ///< linear x, y, z in m/s, angular x, y, z in rad/s

/// The six numbers at the message's end; NaN if it is too short.
inline Velocity velocityOf(const Bytes& bytes) {
  Velocity velocity;
  velocity.fill(std::nan(""));
  if (bytes.size() >= sizeof(Velocity)) {
    std::memcpy(velocity.data(), bytes.data() + bytes.size() - sizeof(Velocity), sizeof(Velocity));
  }
  return velocity;
}

/// The same message with another velocity, and a new stamp if it has a header; a message without a
/// velocity stays as it is.
inline Bytes velocityMessage(Bytes bytes, const PlanarVelocity& wanted, Stamp now) {
  const Velocity velocity{wanted.forward, wanted.left, 0, 0, 0, wanted.turn};
  if (bytes.size() < sizeof(Velocity)) return bytes;
  std::memcpy(bytes.data() + bytes.size() - sizeof(Velocity), velocity.data(), sizeof(Velocity));
  constexpr std::size_t kShortestHeader = 16;  // seq, stamp, the frame's length
  if (bytes.size() >= kShortestHeader + sizeof(Velocity)) {
    const std::uint32_t stamp[] = {static_cast<std::uint32_t>(now.ns / 1'000'000'000),
                                   static_cast<std::uint32_t>(now.ns % 1'000'000'000)};
    std::memcpy(bytes.data() + 4, stamp, sizeof(stamp));
  }
  return bytes;
}

inline bool isFinite(const Velocity& velocity) {
  return std::all_of(velocity.begin(), velocity.end(), [](double v) { return std::isfinite(v); });
}

inline bool isZero(const Velocity& velocity) {
  return std::all_of(velocity.begin(), velocity.end(), [](double v) { return v == 0; });
}

}  // namespace afterglow::replay

/// \file
/// The velocity that a geometry_msgs/Twist or TwistStamped commands, in its bytes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "replay/messages/message.hpp"
#include "replay/motion/planar_pose.hpp"

namespace afterglow::replay {

using Velocity = std::array<double, 6>;  ///< linear x, y, z in m/s, angular x, y, z in rad/s

/// The six numbers at the message's end; not numbers if it is too short.
inline Velocity velocityOf(const Bytes& bytes) {
  Velocity velocity;
  velocity.fill(std::nan(""));
  if (bytes.size() >= sizeof(Velocity)) {
    std::memcpy(velocity.data(), bytes.data() + bytes.size() - sizeof(Velocity), sizeof(Velocity));
  }
  return velocity;
}

/// The same message with another velocity; one that has none stays as it is.
inline Bytes withVelocity(Bytes bytes, const PlanarVelocity& wanted) {
  const Velocity velocity{wanted.forward, 0, 0, 0, 0, wanted.turn};
  if (bytes.size() < sizeof(Velocity)) return bytes;
  std::memcpy(bytes.data() + bytes.size() - sizeof(Velocity), velocity.data(), sizeof(Velocity));
  return bytes;
}

inline bool isFinite(const Velocity& velocity) {
  return std::all_of(velocity.begin(), velocity.end(), [](double v) { return std::isfinite(v); });
}

inline bool isZero(const Velocity& velocity) {
  return std::all_of(velocity.begin(), velocity.end(), [](double v) { return v == 0; });
}

}  // namespace afterglow::replay

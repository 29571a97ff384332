/// \file
/// Poses and velocities of a base on the floor. Meters, radians, seconds; REP-103: x ahead, y left,
/// yaw counter-clockwise.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "replay/messages/message.hpp"

namespace afterglow::replay {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegreesPerRadian = 180 / kPi;

struct PlanarPose {
  double x = 0, y = 0, yaw = 0;

  friend bool operator==(const PlanarPose& a, const PlanarPose& b) {
    return a.x == b.x && a.y == b.y && a.yaw == b.yaw;
  }
};

/// The greatest distance of a known pose from the true one; m along the less certain axis, rad.
struct PoseError {
  double position = 0, yaw = 0;
};

/// Combines errors that do not depend on each other.
inline PoseError combined(const PoseError& a, const PoseError& b) {
  return {std::hypot(a.position, b.position), std::hypot(a.yaw, b.yaw)};
}

/// Headings on either side of one of them; rad, from <= 0 <= to, counter-clockwise.
struct HeadingRange {
  double from = 0, to = 0;
};

/// m/s ahead, rad/s counter-clockwise, and m/s to the left, which only a holonomic base goes.
struct PlanarVelocity {
  double forward = 0, turn = 0, left = 0;

  bool isZero() const { return forward == 0 && turn == 0 && left == 0; }
  double speed() const { return left == 0 ? std::abs(forward) : std::hypot(forward, left); }
};

/// The same angle in [-pi, pi].
inline double wrapAngle(double angle) { return std::remainder(angle, 2 * kPi); }

/// b, given in a, in a's parent.
inline PlanarPose compose(const PlanarPose& a, const PlanarPose& b) {
  const double c = std::cos(a.yaw), s = std::sin(a.yaw);
  return {a.x + c * b.x - s * b.y, a.y + s * b.x + c * b.y, wrapAngle(a.yaw + b.yaw)};
}

inline PlanarPose inverse(const PlanarPose& pose) {
  const double c = std::cos(pose.yaw), s = std::sin(pose.yaw);
  return {-c * pose.x - s * pose.y, s * pose.x - c * pose.y, -pose.yaw};
}

/// b as seen from a; both in the same frame.
inline PlanarPose between(const PlanarPose& a, const PlanarPose& b) {
  return compose(inverse(a), b);
}

inline double distance(const PlanarPose& a, const PlanarPose& b) {
  return std::hypot(b.x - a.x, b.y - a.y);
}

/// Returns the place of a base after an arc of that length, m, on which it turns by so much.
inline PlanarPose alongArc(const PlanarPose& pose, double arc, double turn) {
  // The chord of an arc: exact, and well behaved for a straight line.
  const double half = turn / 2;
  const double chord = std::abs(half) < 1e-9 ? arc : arc * std::sin(half) / half;
  return {pose.x + chord * std::cos(pose.yaw + half), pose.y + chord * std::sin(pose.yaw + half),
          wrapAngle(pose.yaw + turn)};
}

/// Returns the place of a base after `seconds` of a steady velocity.
inline PlanarPose advance(const PlanarPose& pose, const PlanarVelocity& velocity, double seconds) {
  if (velocity.left == 0) {
    return alongArc(pose, velocity.forward * seconds, velocity.turn * seconds);
  }
  // The arc of a base that looks where it goes.
  const double aside = std::atan2(velocity.left, velocity.forward);
  PlanarPose after = alongArc({pose.x, pose.y, pose.yaw + aside}, velocity.speed() * seconds,
                              velocity.turn * seconds);
  after.yaw = wrapAngle(after.yaw - aside);
  return after;
}

/// Returns the direction of a frame's x, seen from above, for an orientation of any length.
inline double headingOf(double qx, double qy, double qz, double qw) {
  return std::atan2(2 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz);
}

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

/// \file
/// How far light lies from where it belongs while its projector moves: the pose that a picture was
/// drawn for, and the one that tf has of the moment of its light afterwards.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "nodes/projector/frame_lookup.hpp"

namespace afterglow::nodes {

/// The offsets of one projector's last pictures. One thread at a time.
class LightOffset {
 public:
  static constexpr double kReach_m = 2;      ///< distance from the lens of what is compared
  static constexpr std::size_t kKept = 256;  ///< pictures: 8 s at 30 Hz

  /// Takes a picture's pose, and the moment at which it is light.
  void add(const Rigid<Projector, World>& drawn, std::int64_t light_ns);
  /// Compares the pictures whose moments tf knows by now; `frame`: the projector's.
  void compare(FrameLookup& frames, const std::string& frame);
  /// Returns the offset that 95 % of the last pictures do not exceed, mm at kReach_m; empty before
  /// the first.
  std::optional<double> mm() const;

 private:
  struct Picture {
    Eigen::Vector3d p_world;  ///< straight ahead of the lens, where it was drawn for
    std::int64_t light_ns;
  };
  std::deque<Picture> waiting_;
  std::vector<double> offsets_;
  std::size_t next_ = 0;  ///< index to be replaced, once it is full
};

}  // namespace afterglow::nodes

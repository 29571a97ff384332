/// \file
/// Where frames lie in the fixed frame, from a tf2 buffer that somebody else fills.
#pragma once

#include <ros/time.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace afterglow::nodes {

/// A newest transform older than this is stale: its frame may be anywhere by now.
constexpr std::int64_t kStalePoseNs = 2'000'000'000;

/// A pose and the time it is of.
struct StampedPose {
  Eigen::Isometry3d T_fixed_frame;
  std::int64_t stamp_ns = 0;  ///< 0: static, true at any time
};

/// Frames are tf names without leading slash. Never waits; what is not known is absent. Lookups are
/// remembered until forget(), so that thousands of markers of one message cost one. The buffer must
/// outlive this; one thread at a time.
class FrameLookup {
 public:
  FrameLookup(const tf2::BufferCore& buffer, std::string fixed_frame);

  const std::string& fixedFrame() const { return fixed_frame_; }
  /// At a stamp; stamp 0 means the newest, absent if it is stale.
  std::optional<Eigen::Isometry3d> at(const std::string& frame, ros::Time stamp);
  std::optional<StampedPose> newest(const std::string& frame);  ///< however old
  bool isStale(const StampedPose& pose) const;
  /// "WHAT: no transform from 'FRAME' to ...", or that it is stale.
  std::string noTransform(const std::string& what, const std::string& frame);
  /// To be called when the buffer may have changed. Stale is judged by `now_ns`; 0: nothing is.
  void forget(std::int64_t now_ns = 0);

 private:
  std::optional<StampedPose> look(const std::string& frame, ros::Time stamp) const;

  const tf2::BufferCore& buffer_;
  std::string fixed_frame_;
  std::int64_t now_ns_ = 0;
  std::map<std::pair<std::string, ros::Time>, std::optional<StampedPose>> known_;
};

}  // namespace afterglow::nodes

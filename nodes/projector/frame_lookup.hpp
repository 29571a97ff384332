/// \file
/// The poses of frames in the fixed frame, from a tf2 buffer that somebody else fills, and where
/// they will be.
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

/// If the newest transform of a frame is older than this, it is stale: the frame may have moved.
constexpr std::int64_t kStalePoseNs = 2'000'000'000;
/// Velocity is measured over this much of the past, where tf has it.
constexpr std::int64_t kVelocityBaseNs = 50'000'000;

/// A pose at a time.
struct StampedPose {
  Eigen::Isometry3d T_fixed_frame;
  std::int64_t stamp_ns = 0;  ///< 0: static, true at any time
};

/// Frames are tf names without leading slash. Never waits: unknown poses are empty. Remembers each
/// lookup until forget(), so that thousands of markers of one message cost one. The buffer must
/// outlive this; one thread at a time.
class FrameLookup {
 public:
  FrameLookup(const tf2::BufferCore& buffer, std::string fixed_frame);

  const std::string& fixedFrame() const { return fixed_frame_; }
  /// Returns the pose at a stamp; stamp 0 means the newest pose, unless it is stale.
  std::optional<Eigen::Isometry3d> at(const std::string& frame, ros::Time stamp);
  std::optional<StampedPose> newest(const std::string& frame);  ///< even if it is stale
  bool isStale(const StampedPose& pose) const;
  /// Returns the frame between this one and the fixed one in which motion is smooth, by REP 105:
  /// odom, or what begins so. Localization corrects where that lies, by leaps. The fixed frame:
  /// there is none.
  std::string smoothFrame(const std::string& frame) const;
  /// Returns where a frame, whose newest pose this is, will be in the fixed one if it goes on as it
  /// moved lately in `smooth`: smoothFrame(), or the fixed frame itself where both belong to one
  /// robot. Empty: it moves, and that is too long after the newest pose.
  std::optional<Eigen::Isometry3d> predicted(const std::string& frame, const StampedPose& newest,
                                             std::int64_t when_ns, const std::string& smooth);
  /// Returns true if the frame is below `carrier` in tf's tree, or is it.
  bool isCarried(const std::string& frame, const std::string& carrier) const;
  /// "SUBJECT: no transform from 'FRAME' to ...", or that it is stale, which link of its chain is
  /// the oldest and by how much: "... is stale: 'base_link' in 'odom' is 3 s old".
  std::string noTransform(const std::string& subject, const std::string& frame);
  /// Returns why content that came at `arrived_ns` is not placed: "stamped 30 s after it came: ..."
  /// (or before) where its stamp is to blame, else as noTransform without its subject.
  std::string notPlaced(const std::string& frame, ros::Time stamp, std::int64_t arrived_ns);
  /// Call it when the buffer may have changed. `now_ns` decides what is stale; 0: nothing is.
  void forget(std::int64_t now_ns = 0);

 private:
  std::optional<StampedPose> look(const std::string& frame, ros::Time stamp) const;
  std::string missing(const std::string& frame);
  std::string oldestLink(const std::string& frame) const;

  const tf2::BufferCore& buffer_;
  std::string fixed_frame_;
  std::int64_t now_ns_ = 0;
  std::map<std::pair<std::string, ros::Time>, std::optional<StampedPose>> known_;
};

/// The pose at `when` if the motion from `earlier` to `later` goes on: a turn about one axis in
/// space and an advance along it (a screw), or a straight line. Exact for a turret and for a base
/// that drives a circle. Throws std::logic_error unless `earlier` is before `later`.
Eigen::Isometry3d extrapolate(const StampedPose& earlier, const StampedPose& later,
                              std::int64_t when_ns);

}  // namespace afterglow::nodes

/// \file
/// /tf and /tf_static into a tf2 buffer, as tf2_ros::TransformListener does it, except for
/// transforms that tf2 would crash on, or store and then answer wrongly for. Tells of frames that
/// hang below several parents.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/ros.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "nodes/projector/topic_monitor.hpp"
#include "nodes/tools/callback_thread.hpp"

namespace afterglow::nodes {

/// Frames that several publishers hang below different parents: tf takes whichever spoke last, and
/// everything below such a frame jumps between two places. Bounded in frames. One thread at a time.
class ParentMonitor {
 public:
  static constexpr std::int64_t kMemoryNs = 5'000'000'000;  ///< a parent not heard of is left

  /// A transform has come, at `now_ns` of any clock that does not run backwards. A static one
  /// replaces the static ones of its publisher.
  void note(const std::string& child, const std::string& parent, const std::string& publisher,
            bool is_static, std::int64_t now_ns);

  /// "frame 'arm' has two parents: 'map' (published by /a) and 'odom' (published by /b)", one line
  /// for each frame with several parents that are static or of the last seconds.
  std::vector<std::string> conflicts(std::int64_t now_ns) const;

 private:
  struct Link {
    std::string publisher;  ///< the last
    std::int64_t at_ns;     ///< the greatest value: static
  };
  std::map<std::string, std::map<std::string, Link>> links_;  ///< links by child and parent
};

/// Listens in a thread of its own. Clears the buffer when ROS time jumps back. Counts transforms
/// that storeTransform refuses. The buffer must outlive this.
class TransformListener {
 public:
  explicit TransformListener(tf2::BufferCore& buffer);

  /// Returns how many messages came, why transforms were refused, and what was odd about others;
  /// the other fields are empty.
  LayerStatus status() const;
  /// Frames with several parents, and who publishes them (ParentMonitor).
  std::vector<std::string> conflicts() const;

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;
  void take(const Event& event, bool is_static);

  tf2::BufferCore& buffer_;
  ros::Time last_time_;
  mutable std::mutex mutex_;  ///< guards what follows
  LayerStatus status_;
  ParentMonitor parents_;
  CallbackThread thread_;
};

struct StoredTransform {
  bool is_stored = false;
  /// The reason why it is not stored, or what is odd about it although it is. Names the frame.
  std::string reason;
};

/// Stores a transform. Beside those that tf2 refuses, refuses absurdly far places, stamps that are
/// no time, and stamps so far ahead of `now` (ROS time; 0: unknown) that all later transforms would
/// count as old. The stamp of a static transform has no meaning. A frame that jumps stays where it
/// was until the jump: tf2 would put it on the way between, through walls. Any thread.
StoredTransform storeTransform(tf2::BufferCore& buffer,
                               const geometry_msgs::TransformStamped& transform,
                               const std::string& authority, bool is_static, ros::Time now);

}  // namespace afterglow::nodes

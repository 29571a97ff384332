/// \file
/// /tf and /tf_static into a tf2 buffer, as tf2_ros::TransformListener does it, except for
/// transforms that tf2 would crash on, or store and then answer wrongly for.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <ros/spinner.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <mutex>
#include <string>
#include <vector>

#include "nodes/projector/layer_status.hpp"
#include "nodes/projector/parent_watch.hpp"

namespace afterglow::nodes {

/// Listens in a thread of its own. Clears the buffer when ROS time jumps back. Counts transforms
/// that storeTransform refuses. The buffer must outlive this.
class TransformListener {
 public:
  explicit TransformListener(tf2::BufferCore& buffer);
  ~TransformListener();

  /// Returns how many messages came, why transforms were refused, and what was odd about others;
  /// the other fields are empty.
  LayerStatus status() const;
  /// Frames with several parents, and who publishes them (ParentWatch).
  std::vector<std::string> conflicts() const;

 private:
  void take(const ros::MessageEvent<const tf2_msgs::TFMessage>& event, bool is_static);

  tf2::BufferCore& buffer_;
  ros::CallbackQueue queue_;
  ros::NodeHandle nh_;
  ros::Subscriber moving_, fixed_;
  ros::Time last_time_;
  mutable std::mutex mutex_;  ///< guards what follows
  LayerStatus status_;
  ParentWatch parents_;
  ros::AsyncSpinner spinner_{1, &queue_};
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

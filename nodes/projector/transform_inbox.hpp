/// \file
/// /tf and /tf_static into a buffer: tf2_ros::TransformListener, but for transforms that would
/// bring it down (transform_intake.hpp).
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <ros/spinner.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <mutex>

#include "nodes/projector/layer_state.hpp"

namespace afterglow::nodes {

/// Listens in a thread of its own. Clears the buffer when ROS time jumps back. What is refused is
/// counted. The buffer must outlive this.
class TransformInbox {
 public:
  explicit TransformInbox(tf2::BufferCore& buffer);
  ~TransformInbox();

  /// Messages, and what was refused or odd of them; nothing else.
  LayerStatus status() const;

 private:
  void take(const ros::MessageEvent<const tf2_msgs::TFMessage>& event, bool is_static);

  tf2::BufferCore& buffer_;
  ros::CallbackQueue queue_;
  ros::NodeHandle nh_;
  ros::Subscriber moving_, fixed_;
  ros::Time last_time_;
  mutable std::mutex mutex_;  ///< counts_
  LayerState counts_;
  ros::AsyncSpinner spinner_{1, &queue_};
};

}  // namespace afterglow::nodes

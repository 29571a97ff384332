/// \file
/// The one way into a tf2 buffer: past what tf2 would store and be led astray by, or die of.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>

#include <string>

namespace afterglow::nodes {

/// What became of a transform.
struct Intake {
  bool is_stored = false;
  std::string
      reason;  ///< why not; beside one that is stored: what is odd about it. Names its frame
};

/// Stores a transform. Refused, beside what tf2 refuses: a place absurdly far; a stamp that is no
/// time, or so far ahead of `now` (ROS time; 0: unknown) that everything after it would count as
/// old. A static one's stamp means nothing. A frame that jumps is where it was until it jumps:
/// nothing is drawn on the way between, through walls. Any thread.
Intake takeTransform(tf2::BufferCore& buffer, const geometry_msgs::TransformStamped& transform,
                     const std::string& authority, bool is_static, ros::Time now);

}  // namespace afterglow::nodes

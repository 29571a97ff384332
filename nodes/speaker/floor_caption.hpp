/// \file
/// The spoken text as a text marker for a projector, for those who cannot hear it.
#pragma once

#include <ros/ros.h>
#include <visualization_msgs/Marker.h>

#include <memory>
#include <string>

namespace afterglow::nodes {

/// Topic: ~caption_topic (visualization_msgs/Marker, TEXT_VIEW_FACING). Parameters: ~caption_topic
/// ("": none), ~caption_frame (map), ~caption_position ([0, 0, 0], m), ~caption_height (0.08, m, of
/// a capital), ~caption_line (40, letters; longer ones are broken between words).
class FloorCaption {
 public:
  /// Empty without a topic. Throws std::runtime_error for a parameter that cannot be obeyed.
  static std::unique_ptr<FloorCaption> read(ros::NodeHandle node,
                                            const ros::NodeHandle& private_node);

  /// An empty text removes the caption.
  void show(const std::string& text);

 private:
  FloorCaption() = default;

  visualization_msgs::Marker marker_;
  int longest_line_ = 40;
  ros::Publisher publisher_;
};

}  // namespace afterglow::nodes

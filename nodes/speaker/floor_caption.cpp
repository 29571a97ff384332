#include "nodes/speaker/floor_caption.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace afterglow::nodes {
namespace {

/// Breaks lines between words, where they would become longer than so many bytes.
std::string inLines(const std::string& text, int longest) {
  std::istringstream words(text);
  std::string lines, line;
  for (std::string word; words >> word;) {
    const bool fits =
        line.empty() || line.size() + 1 + word.size() <= static_cast<std::size_t>(longest);
    if (!fits) lines += line + "\n";
    line = (fits && !line.empty() ? line + " " : "") + word;
  }
  return lines + line;
}

}  // namespace

std::unique_ptr<FloorCaption> FloorCaption::read(ros::NodeHandle node,
                                                 const ros::NodeHandle& private_node) {
  const auto topic = private_node.param<std::string>("caption_topic", "");
  if (topic.empty()) return nullptr;
  std::unique_ptr<FloorCaption> caption(new FloorCaption);
  visualization_msgs::Marker& marker = caption->marker_;
  marker.header.frame_id = private_node.param<std::string>("caption_frame", "map");
  const auto position =
      private_node.param<std::vector<double>>("caption_position", std::vector<double>(3, 0.0));
  if (position.size() != 3) throw std::runtime_error("~caption_position is not three numbers");
  marker.pose.position.x = position[0];
  marker.pose.position.y = position[1];
  marker.pose.position.z = position[2];
  marker.scale.z = private_node.param("caption_height", 0.08);
  if (!(marker.scale.z > 0) || !std::isfinite(marker.scale.z)) {
    throw std::runtime_error("~caption_height is no height");
  }
  caption->longest_line_ = private_node.param("caption_line", caption->longest_line_);
  if (caption->longest_line_ < 1) throw std::runtime_error("~caption_line is below 1");
  marker.ns = "speech";
  marker.type = visualization_msgs::Marker::TEXT_VIEW_FACING;
  marker.pose.orientation.w = 1;
  marker.color.r = marker.color.g = marker.color.b = marker.color.a = 1;
  caption->publisher_ = node.advertise<visualization_msgs::Marker>(topic, 2, true);
  return caption;
}

void FloorCaption::show(const std::string& text) {
  marker_.action =
      text.empty() ? visualization_msgs::Marker::DELETE : visualization_msgs::Marker::ADD;
  marker_.text = inLines(text, longest_line_);
  publisher_.publish(marker_);
}

}  // namespace afterglow::nodes

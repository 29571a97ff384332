#include "nodes/conversion/path_conversion.hpp"

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {

Converted<render::Lines> toLines(const nav_msgs::Path& message, float width) {
  using Result = render::Lines;
  if (message.poses.size() > kMostPoints) return refused<Result>("too many points");
  Result line;
  line.width = width;
  for (const geometry_msgs::PoseStamped& pose : message.poses) {
    const std::string frame = frameName(pose.header.frame_id);
    if (!frame.empty() && frame != frameName(message.header.frame_id)) {
      return refused<Result>("a pose is in another frame than its path");
    }
    const geometry_msgs::Point& position = pose.pose.position;
    const auto point = toVector(position.x, position.y, position.z);
    if (!point) return refused<Result>("a pose is not finite or absurdly far");
    if (line.points.empty() || line.points.back() != *point) line.points.push_back(*point);
  }
  if (line.points.size() < 2) line.points.clear();
  return {std::move(line), {}};
}

}  // namespace afterglow::nodes

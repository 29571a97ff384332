#include "nodes/kitting/kitting_messages.hpp"

#include <sensor_msgs/point_cloud2_iterator.h>

#include "nodes/conversion/geometry_conversion.hpp"

namespace afterglow::nodes {
namespace {

using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

constexpr double kSpacing = 0.26;  // m: an arrow's length, and the gap to the next
constexpr double kShaft = 0.15, kHead = 0.30, kGoalSize = 0.35;  // m; diameters
constexpr double kHeadLength = 0.15;  // m: seen as an arrow from aside, too

Marker pathMarker(int id, int type) {
  Marker marker;
  marker.header.frame_id = "map";
  marker.id = id;
  marker.type = type;
  marker.lifetime = ros::Duration(10);
  return marker;  // orientation stays all zero, as the authors' does
}

geometry_msgs::Point onFloor(const Eigen::Vector2d& p) { return toPointMessage({p.x(), p.y(), 0}); }

}  // namespace

geometry_msgs::Point toPointMessage(const Eigen::Vector3d& p) {
  geometry_msgs::Point point;
  point.x = p.x(), point.y = p.y(), point.z = p.z();
  return point;
}

geometry_msgs::Pose toPoseMessage(const Eigen::Isometry3d& T_parent_child) {
  geometry_msgs::Pose pose;
  pose.position = toPointMessage(T_parent_child.translation());
  pose.orientation = toTransform(T_parent_child).rotation;
  return pose;
}

void setLook(Marker& marker, const Eigen::Vector3d& size, const render::Color& color) {
  marker.scale.x = size.x(), marker.scale.y = size.y(), marker.scale.z = size.z();
  marker.color.r = color.r, marker.color.g = color.g, marker.color.b = color.b;
  marker.color.a = color.a;
}

sensor_msgs::PointCloud2 pointCloud(const std::vector<Eigen::Vector3d>& points) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = "base_link";
  cloud.header.stamp = ros::Time::now();
  cloud.height = 1;
  cloud.is_dense = true;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(1, "xyz");
  modifier.resize(points.size());
  if (points.empty()) return cloud;  // an iterator starts at the first byte, which there is not
  sensor_msgs::PointCloud2Iterator<float> x(cloud, "x"), y(cloud, "y"), z(cloud, "z");
  for (const Eigen::Vector3d& p : points) {
    *x = static_cast<float>(p.x()), *y = static_cast<float>(p.y()), *z = static_cast<float>(p.z());
    ++x, ++y, ++z;
  }
  return cloud;
}

MarkerArray pathMarkers(const FloorPath& path) {
  MarkerArray array;
  const double length = lengthOf(path);
  for (double along = 0; along + kSpacing <= length; along += 2 * kSpacing) {
    Marker arrow = pathMarker(static_cast<int>(array.markers.size()), Marker::ARROW);
    arrow.points = {onFloor(pointAlong(path, along)), onFloor(pointAlong(path, along + kSpacing))};
    setLook(arrow, {kShaft, kHead, kHeadLength}, {1, 0, 1});
    array.markers.push_back(arrow);
  }
  Marker goal = pathMarker(static_cast<int>(array.markers.size()), Marker::SPHERE);
  goal.pose.position = onFloor(path.back());
  setLook(goal, {kGoalSize, kGoalSize, kGoalSize}, {0, 1, 0});
  array.markers.push_back(goal);
  return array;
}

Marker sectionMarker(const Eigen::Isometry3d& T_base_section, const Eigen::Vector3d& size) {
  Marker marker;
  marker.header.frame_id = "base_link";
  marker.type = Marker::CUBE;
  marker.pose = toPoseMessage(T_base_section);
  setLook(marker, size, {255, 255, 255});
  marker.lifetime = ros::Duration(60);
  return marker;
}

MarkerArray noMarkers() {
  MarkerArray none;
  none.markers.resize(1);
  none.markers[0].header.frame_id = "map";
  none.markers[0].action = Marker::DELETEALL;
  return none;
}

}  // namespace afterglow::nodes

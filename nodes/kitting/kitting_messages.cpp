#include "nodes/kitting/kitting_messages.hpp"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <cmath>

namespace afterglow::nodes {
namespace {

using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

geometry_msgs::Point toPoint(const Eigen::Vector3d& p) {
  geometry_msgs::Point point;
  point.x = p.x(), point.y = p.y(), point.z = p.z();
  return point;
}

geometry_msgs::Vector3 toVector(const Eigen::Vector3d& v) {
  geometry_msgs::Vector3 vector;
  vector.x = v.x(), vector.y = v.y(), vector.z = v.z();
  return vector;
}

geometry_msgs::Pose toPose(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  geometry_msgs::Pose pose;
  pose.position = toPoint(T.translation());
  pose.orientation.x = q.x(), pose.orientation.y = q.y();
  pose.orientation.z = q.z(), pose.orientation.w = q.w();
  return pose;
}

std_msgs::ColorRGBA color(float r, float g, float b) {
  std_msgs::ColorRGBA result;
  result.r = r, result.g = g, result.b = b, result.a = 1;
  return result;
}

Marker partMarker(const Part& part) {
  Marker marker;
  marker.color = color(part.paint.r, part.paint.g, part.paint.b);
  if (part.shape != Part::Shape::Prism) {
    marker.type = part.shape == Part::Shape::Box ? Marker::CUBE : Marker::CYLINDER;
    marker.scale = toVector(part.size);
    return marker;
  }
  marker.type = Marker::TRIANGLE_LIST;
  marker.scale = toVector(Eigen::Vector3d::Ones());
  for (const Triangle& triangle : partTriangles(part)) {
    for (const Eigen::Vector3d& p : triangle) marker.points.push_back(toPoint(p));
  }
  return marker;
}

Marker pathMarker(const std::string& frame, int id, int type) {
  Marker marker;
  marker.header.frame_id = frame;
  marker.id = id;
  marker.type = type;
  marker.lifetime = ros::Duration(10);
  return marker;  // orientation stays all zero, as the authors' does
}

Eigen::Vector3d onFloor(const Eigen::Vector2d& p) { return {p.x(), p.y(), 0}; }

}  // namespace

MarkerArray solidMarkers(const Thing& thing, const std::string& frame,
                         const Eigen::Isometry3d& T_frame_thing) {
  MarkerArray array;
  for (const Part& part : thing.parts) {
    Marker marker = partMarker(part);
    marker.header.frame_id = frame;
    marker.ns = thing.name;
    marker.id = static_cast<int>(array.markers.size());
    marker.pose = toPose(T_frame_thing * part.T_thing_part);
    marker.frame_locked = true;  // what is carried moves with the gripper
    array.markers.push_back(marker);
  }
  return array;
}

MarkerArray removedMarkers(const Thing& thing, const std::string& frame) {
  MarkerArray array;
  for (std::size_t i = 0; i < thing.parts.size(); ++i) {
    Marker marker;
    marker.header.frame_id = frame;
    marker.ns = thing.name;
    marker.id = static_cast<int>(i);
    marker.action = Marker::DELETE;
    array.markers.push_back(marker);
  }
  return array;
}

sensor_msgs::PointCloud2 pointCloud(const std::string& frame, const ros::Time& stamp,
                                    const std::vector<Eigen::Vector3d>& points) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = frame;
  cloud.header.stamp = stamp;
  cloud.height = 1;
  cloud.is_dense = true;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(1, "xyz");
  modifier.resize(points.size());
  sensor_msgs::PointCloud2Iterator<float> x(cloud, "x"), y(cloud, "y"), z(cloud, "z");
  for (const Eigen::Vector3d& p : points) {
    *x = static_cast<float>(p.x()), *y = static_cast<float>(p.y()), *z = static_cast<float>(p.z());
    ++x, ++y, ++z;
  }
  return cloud;
}

sensor_msgs::LaserScan laserScan(const std::string& frame, const ros::Time& stamp,
                                 const ScanGeometry& geometry, const std::vector<float>& ranges) {
  sensor_msgs::LaserScan scan;
  scan.header.frame_id = frame;
  scan.header.stamp = stamp;
  scan.angle_min = static_cast<float>(geometry.angle_min);
  scan.angle_increment = static_cast<float>(geometry.angle_increment);
  scan.angle_max =
      static_cast<float>(geometry.angle_min + (geometry.beams - 1) * geometry.angle_increment);
  scan.range_min = 0.05f;
  scan.range_max = static_cast<float>(geometry.range_max);
  scan.ranges = ranges;
  return scan;
}

MarkerArray pathMarkers(const std::string& frame, const FloorPath& path,
                        const PathMarkerStyle& style) {
  MarkerArray array;
  const double length = lengthOf(path);
  for (double along = 0; along + style.spacing <= length; along += 2 * style.spacing) {
    Marker arrow = pathMarker(frame, static_cast<int>(array.markers.size()), Marker::ARROW);
    arrow.points = {toPoint(onFloor(pointAlong(path, along))),
                    toPoint(onFloor(pointAlong(path, along + style.spacing)))};
    arrow.scale.x = style.shaft, arrow.scale.y = style.head;
    arrow.color = color(1, 0, 1);
    array.markers.push_back(arrow);
  }
  Marker goal = pathMarker(frame, static_cast<int>(array.markers.size()), Marker::SPHERE);
  goal.pose.position = toPoint(onFloor(path.back()));
  goal.scale = toVector(Eigen::Vector3d::Constant(style.goal));
  goal.color = color(0, 1, 0);
  array.markers.push_back(goal);
  return array;
}

Marker sectionMarker(const std::string& frame, const Eigen::Isometry3d& pose,
                     const Eigen::Vector3d& size) {
  Marker marker;
  marker.header.frame_id = frame;
  marker.type = Marker::CUBE;
  marker.pose = toPose(pose);
  marker.scale = toVector(size);
  marker.color = color(255, 255, 255);
  marker.lifetime = ros::Duration(60);
  return marker;
}

Marker removedSectionMarker(const std::string& frame) {
  Marker marker;
  marker.header.frame_id = frame;
  marker.action = Marker::DELETE;
  return marker;
}

geometry_msgs::Twist twist(const PlanarVelocity& command) {
  geometry_msgs::Twist message;
  message.linear.x = command.forward;
  message.angular.z = command.turn;
  return message;
}

sound_play::SoundRequest sayRequest(const std::string& text, const std::string& voice) {
  sound_play::SoundRequest request;
  request.sound = sound_play::SoundRequest::SAY;
  request.command = sound_play::SoundRequest::PLAY_ONCE;
  request.volume = 1;
  request.arg = text;
  request.arg2 = voice;
  return request;
}

}  // namespace afterglow::nodes

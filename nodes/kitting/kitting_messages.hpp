/// \file
/// The demo's values as the ROS messages that the paper's authors sent (predecessors of this
/// project: arrow_projection, projection_mapping, robot-behavior-replay).
#pragma once

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Pose.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include <Eigen/Geometry>
#include <vector>

#include "nodes/kitting/kitting_drive.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

geometry_msgs::Point toPointMessage(const Eigen::Vector3d& p);
geometry_msgs::Pose toPoseMessage(const Eigen::Isometry3d& T_parent_child);

/// Size and color of a marker.
void setLook(visualization_msgs::Marker& marker, const Eigen::Vector3d& size,
             const render::Color& color);

/// x, y, z float32, unorganized, in base_link. Of no points: the authors' way to clear a
/// projection.
sensor_msgs::PointCloud2 pointCloud(const std::vector<Eigen::Vector3d>& points);

/// Returns the markers that arrow_projection sends: magenta arrows along the path, every second
/// gap, and a green sphere at its end, on the floor of map; stamp 0, no namespace, lifetime 10 s.
visualization_msgs::MarkerArray pathMarkers(const FloorPath& path);

/// The white cube (lifetime 60 s, stamp 0, color components 255 as the authors send them) that
/// marks a caddy section, in base_link.
visualization_msgs::Marker sectionMarker(const Eigen::Isometry3d& T_base_section,
                                         const Eigen::Vector3d& size);

/// Takes away all that a MarkerArray topic shows.
visualization_msgs::MarkerArray noMarkers();

}  // namespace afterglow::nodes

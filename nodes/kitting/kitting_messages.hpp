/// \file
/// The demo's values as the ROS messages that the paper's authors sent (predecessors of this
/// project: arrow_projection, projection_mapping, robot-behavior-replay), and the room's solids.
#pragma once

#include <geometry_msgs/Twist.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>
#include <sound_play/SoundRequest.h>
#include <visualization_msgs/MarkerArray.h>

#include <string>
#include <vector>

#include "nodes/kitting/kitting_path.hpp"
#include "nodes/kitting/kitting_world.hpp"

namespace afterglow::nodes {

/// One solid marker per part; namespace = the thing's name, id = the part's index. `frame` and
/// `T_frame_thing` say where it is: map and its pose, or the gripper that carries it.
visualization_msgs::MarkerArray solidMarkers(const Thing& thing, const std::string& frame,
                                             const Eigen::Isometry3d& T_frame_thing);
/// Removes what solidMarkers() showed.
visualization_msgs::MarkerArray removedMarkers(const Thing& thing, const std::string& frame);

/// x, y, z float32, unorganized. Of no points: the authors' way to clear a projection.
sensor_msgs::PointCloud2 pointCloud(const std::string& frame, const ros::Time& stamp,
                                    const std::vector<Eigen::Vector3d>& points);

sensor_msgs::LaserScan laserScan(const std::string& frame, const ros::Time& stamp,
                                 const ScanGeometry& geometry, const std::vector<float>& ranges);

/// What arrow_projection sends: magenta arrows along the path, every second gap, and a green sphere
/// at its end, in a frame whose floor is z = 0; stamp 0, no namespace, lifetime 10 s.
visualization_msgs::MarkerArray pathMarkers(const std::string& frame, const FloorPath& path,
                                            const PathMarkerStyle& style);

/// The white cube (lifetime 60 s, stamp 0, color components 255 as the authors send them) that
/// marks a caddy section.
visualization_msgs::Marker sectionMarker(const std::string& frame, const Eigen::Isometry3d& pose,
                                         const Eigen::Vector3d& size);
/// Takes it away.
visualization_msgs::Marker removedSectionMarker(const std::string& frame);

geometry_msgs::Twist twist(const PlanarVelocity& command);

/// Says `text` once at full volume.
sound_play::SoundRequest sayRequest(const std::string& text, const std::string& voice);

}  // namespace afterglow::nodes

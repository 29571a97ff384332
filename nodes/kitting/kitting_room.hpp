/// \file
/// What really stands in the simulated room, shown to the bystander's view on /room/solids. Only
/// the demo and that view know it: robot, recorder and player never see this topic.
#pragma once

#include <ros/ros.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <map>
#include <string>

#include "nodes/kitting/kitting_world.hpp"

namespace afterglow::nodes {

/// Every change is published at once: a latched array that clears all and shows the whole room.
/// Tabletops become static tf frames named after their thing, z up, origin in the middle.
class KittingRoom {
 public:
  explicit KittingRoom(World world);

  const World& world() const { return world_; }
  void show();
  /// From now on the thing moves with this link.
  void carry(const std::string& name, const std::string& link,
             const Eigen::Isometry3d& T_link_thing);
  /// Lets go of a carried thing here.
  void putDown(const std::string& name, const Eigen::Isometry3d& T_map_thing);
  /// Takes everything away but the furniture.
  void removeObjects();

 private:
  struct Carried {
    std::string link;
    Eigen::Isometry3d T_link_thing;
  };

  void announceSurfaces();

  World world_;
  std::map<std::string, Carried> carried_;
  ros::NodeHandle node_;
  ros::Publisher solids_;
  tf2_ros::StaticTransformBroadcaster static_tf_;
};

}  // namespace afterglow::nodes

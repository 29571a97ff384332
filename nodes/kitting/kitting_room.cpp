#include "nodes/kitting/kitting_room.hpp"

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/kitting/kitting_messages.hpp"

namespace afterglow::nodes {

KittingRoom::KittingRoom(World world)
    : world_(std::move(world)),
      solids_(node_.advertise<visualization_msgs::MarkerArray>("/room/solids", 1, true)) {
  announceSurfaces();
}

void KittingRoom::announceSurfaces() {
  std::vector<geometry_msgs::TransformStamped> frames;
  for (const Thing& thing : world_.things()) {
    if (!thing.surface) continue;
    geometry_msgs::TransformStamped frame;
    frame.header.stamp = ros::Time::now();
    frame.header.frame_id = "map";
    frame.child_frame_id = thing.name;
    frame.transform = toTransform(thing.T_map_thing *
                                  Eigen::Translation3d(Eigen::Vector3d(0, 0, *thing.surface)));
    frames.push_back(frame);
  }
  static_tf_.sendTransform(frames);
}

void KittingRoom::show() {
  visualization_msgs::MarkerArray room;
  room.markers.emplace_back();
  room.markers.back().header.frame_id = "map";
  room.markers.back().action = visualization_msgs::Marker::DELETEALL;
  for (const Thing& thing : world_.things()) {
    const auto carried = carried_.find(thing.name);
    const auto solids = carried == carried_.end() ? solidMarkers(thing, "map", thing.T_map_thing)
                                                  : solidMarkers(thing, carried->second.link,
                                                                 carried->second.T_link_thing);
    room.markers.insert(room.markers.end(), solids.markers.begin(), solids.markers.end());
  }
  solids_.publish(room);
}

void KittingRoom::carry(const std::string& name, const std::string& link,
                        const Eigen::Isometry3d& T_link_thing) {
  carried_[name] = {link, T_link_thing};
  show();
}

void KittingRoom::putDown(const std::string& name, const Eigen::Isometry3d& T_map_thing) {
  carried_.erase(name);
  world_.place(name, T_map_thing);
  show();
}

void KittingRoom::removeObjects() {
  carried_.clear();
  world_.removeObjects();
  show();
}

}  // namespace afterglow::nodes

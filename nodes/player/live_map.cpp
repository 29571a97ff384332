#include "nodes/player/live_map.hpp"

#include <nav_msgs/OccupancyGrid.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include "nodes/conversion/map_identity.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "replay/record/snapshot.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kMapPatience = 5;  // s: it may be large

}  // namespace

std::string whyOtherMap(const replay::Behavior& behavior, const std::string& topic,
                        const std::function<bool()>& is_stopped) {
  const std::string recorded = replay::recordedMap(behavior);
  if (recorded.empty()) return "";
  std::string now;
  if (!askMaster(deadlineIn(kMasterPatience)).otherPublishers(topic).empty()) {
    ros::CallbackQueue queue;
    ros::NodeHandle node;
    node.setCallbackQueue(&queue);
    const ros::Subscriber subscriber = node.subscribe<nav_msgs::OccupancyGrid>(
        topic, 1,
        [&now](const nav_msgs::OccupancyGridConstPtr& map) { now = mapIdentity(*map); });
    waitUntil(deadlineIn(kMapPatience), is_stopped, [&] {
      queue.callAvailable();
      return !now.empty();
    });
  }
  if (now == recorded || is_stopped()) return "";
  return now.empty() ? "it was recorded on a map, and nobody publishes one on " + topic + " now"
                     : "the map on " + topic + " is not the one it was recorded on";
}

}  // namespace afterglow::nodes

// afterglow_ros2_watch: stops a robot of ROS 2 when the bridge, a player behind it, its machine or
// the network is gone (nodes/ros2/README.md).
#include <memory>

#include "nodes/guard/guard_node.hpp"
#include "nodes/guard/guard_program.hpp"
#include "nodes/ros2/ros2_bridge_node.hpp"
#include "nodes/ros2/ros2_stops.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const GuardText text{"afterglow_ros2_watch",
                       "stops a robot of ROS 2 when the bridge, or a player behind it, is gone.",
                       "ros2.launch"};
  return runGuard(argc, argv, text, [] {
    DdsParticipant participant(readRos2Network(ros::NodeHandle("~")), "afterglow_ros2_watch", {});
    Ros2Stops stops(participant);
    GuardNode guard(
        [&](const auto& outputs, const auto& known) { return stops.ways(outputs, known); });
    const auto beats = hearBeats(participant, ros::this_node::getName() + "/beats",
                                 [&](const GuardBeat& beat) { guard.hear(beat); });
    guard.run();
  });
}

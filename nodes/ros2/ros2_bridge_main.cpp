#include <malloc.h>

#include "nodes/guard/guard_program.hpp"
#include "nodes/ros2/ros2_bridge_node.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  // Large messages come and go all the time; without this, each would be new pages from the kernel.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
  goFirst(10);  // a bridge that waits for a processor is taken for one that hangs
  const NodeText text{"ros2_bridge_node",
                      "carries topics between a graph of ROS 2 and ROS 1, each while it is wanted.",
                      "ros2.launch"};
  return runNode(argc, argv, text, [](const ros::NodeHandle& own, const auto&) {
    Ros2BridgeNode node(Ros2BridgeOptions::read(own));
    const Registration registration;
    // A second thread would spin as long as the first is busy with the only topic.
    ros::AsyncSpinner spinner(1);
    spinner.start();
    waitForStop();
    spinner.stop();
  });
}

#include <malloc.h>

#include "nodes/recorder/recorder_node.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  // Large messages come and go all the time; without this, each would be new pages from the kernel.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
  const NodeText text{"recorder_node", "records behaviors into a store: by action and by service.",
                      "recorder.launch"};
  return runNode(argc, argv, text, [](const ros::NodeHandle& own, const auto&) {
    const RecorderNodeOptions options = RecorderNodeOptions::read(own);
    RecorderNode node(options);
    const Registration registration;
    boundWaitsForMaster();
    // Starting a behavior waits for connections; the others go on meanwhile.
    ros::AsyncSpinner spinner(4);
    spinner.start();
    waitForStop();
    node.close();
    if (const std::string rest = node.sendRest(); !rest.empty()) ROS_WARN_STREAM(rest);
    letMessagesLeave();
    spinner.stop();
  });
}

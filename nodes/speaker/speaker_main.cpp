#include "nodes/speaker/speaker_node.hpp"

#include "nodes/tools/node_main.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const NodeText text{"speaker_node", "speaks and plays what /robotsound asks for.",
                      "speaker.launch"};
  return runNode(argc, argv, text, [](const ros::NodeHandle& own, const auto&) {
    SpeakerNode node{ros::NodeHandle(), own};
    const Registration registration;
    ros::AsyncSpinner spinner(1);
    spinner.start();
    waitForStop();
    spinner.stop();
    node.stop();
  });
}

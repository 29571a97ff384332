#include "nodes/fetch/fake_fetch_node.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const NodeText text{"fake_fetch_node", "simulates a Fetch without a camera.", "fake_fetch.launch",
                      "fake_fetch"};
  return runNode(argc, argv, text, [](const ros::NodeHandle& own, const auto&) {
    ros::NodeHandle node;
    ros::Time::waitForValid();
    FakeFetchNode robot(readRobotDescription(node), readFakeFetchConfig(own));
    ros::AsyncSpinner spinner(2);
    spinner.start();
    waitForStop();
    spinner.stop();
  });
}

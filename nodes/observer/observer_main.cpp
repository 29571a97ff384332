#include "nodes/observer/observer_node.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const NodeText text{"observer_node", "draws the room as a bystander sees it.", "observer.launch"};
  return runNode(argc, argv, text, [](const ros::NodeHandle& own, const auto&) {
    ObserverNode node(ObserverNodeOptions::read(own));
    node.run([] { return isStopRequested() || !ros::ok(); });
  });
}

#include "nodes/ask/ask_node.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const NodeText text{"ask_node",
                      "answers questions about what the robot did: by topic and by action.",
                      "ask.launch"};
  return runNode(argc, argv, text, [](const ros::NodeHandle& own, const auto&) {
    AskNode node(AskNodeOptions::read(own));
    ros::AsyncSpinner spinner(2);
    spinner.start();
    waitForStop();
    letMessagesLeave();
    spinner.stop();
  });
}

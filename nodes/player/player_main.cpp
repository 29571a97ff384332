#include "nodes/player/player_node.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const NodeText text{"player_node", "replays stored behaviors: by action and by service.",
                      "player.launch"};
  return runNode(argc, argv, text, [](const ros::NodeHandle& own, const auto&) {
    PlayerNode node(PlayerNodeOptions::read(own));
    ros::AsyncSpinner spinner(2);
    spinner.start();
    waitForStop();
    node.close("the player was stopped");
    letMessagesLeave();
    spinner.stop();
  });
}

// afterglow_guard: runs on the robot, and stops it when a player, its machine or the network is
// gone (nodes/README.md).
#include "nodes/guard/guard_node.hpp"
#include "nodes/guard/guard_program.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const GuardText text{"afterglow_guard",
                       "stops this robot when a player, its machine or the network is gone.",
                       "guard.launch"};
  return runGuard(argc, argv, text, [] { GuardNode().run(); });
}

// The verbs that listen to the running robot, `afterglow play` and `afterglow watch`, and
// `afterglow ask`.
#include "nodes/verbs/command.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  return runCommand(argc, argv, {addAskVerb, addPlayVerb, addWatchVerb});
}

// The verbs that listen to the running robot, `afterglow play`, `record` and `watch`, and
// `afterglow ask`.
#include "nodes/verbs/command.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  return runCommand(argc, argv,
                    {addAskVerb, addExampleVerb, addPlayVerb, addRecordVerb, addWatchVerb});
}

// The verbs that listen to the running robot, `afterglow play`, `record` and `watch`, and
// `afterglow ask`.
#include <algorithm>
#include <string>

#include "nodes/verbs/command.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  // What `record` runs as the behavior has options of its own, which CLI11 would take for ours.
  const bool is_record = argc > 1 && argv[1] == std::string("record");
  char** const end = is_record ? std::find(argv, argv + argc, std::string("--")) : argv + argc;
  return runCommand(static_cast<int>(end - argv), argv,
                    {addAskVerb, addPlayVerb, addRecordVerb, addWatchVerb});
}

// `afterglow calibrate`: boards, patterns, and what is solved with them; a file a verb.
#include "nodes/verbs/command.hpp"

namespace afterglow::nodes {

void addCalibrateVerb(CLI::App& app) {
  CLI::App* calibrate = addVerb(app, "calibrate");
  calibrate->require_subcommand(1);
  addCalibrateBoard(*calibrate);
  addCalibratePattern(*calibrate);
  addCalibrateSolve(*calibrate);
  addCalibrateMount(*calibrate);
  addCalibrateVerify(*calibrate);
  addCalibrateColor(*calibrate);
  addCalibrateLatency(*calibrate);
}

}  // namespace afterglow::nodes

int main(int argc, char** argv) {
  return afterglow::nodes::runCommand(argc, argv, {afterglow::nodes::addCalibrateVerb});
}

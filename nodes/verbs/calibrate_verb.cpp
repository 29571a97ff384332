#include "nodes/verbs/calibrate_verb.hpp"

#include "nodes/verbs/calibrate_board.hpp"
#include "nodes/verbs/calibrate_mount.hpp"
#include "nodes/verbs/calibrate_pattern.hpp"
#include "nodes/verbs/calibrate_solve.hpp"
#include "nodes/verbs/calibrate_verify.hpp"

namespace afterglow::nodes {

void addCalibrateVerb(CLI::App& app) {
  CLI::App* calibrate = app.add_subcommand("calibrate", kCalibrateHelp);
  calibrate->require_subcommand(1);
  addCalibrateBoard(*calibrate);
  addCalibratePattern(*calibrate);
  addCalibrateSolve(*calibrate);
  addCalibrateMount(*calibrate);
  addCalibrateVerify(*calibrate);
}

}  // namespace afterglow::nodes

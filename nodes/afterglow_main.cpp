// The command `afterglow`: the verbs that need a store alone are in here, others are programs
// beside it (nodes/verbs/command.hpp).
#include <algorithm>
#include <string>

#include "nodes/verbs/calibrate_verb.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/export_verb.hpp"
#include "nodes/verbs/import_verb.hpp"
#include "nodes/verbs/list_verb.hpp"
#include "nodes/verbs/play_verb.hpp"
#include "nodes/verbs/render_verb.hpp"
#include "nodes/verbs/said_verb.hpp"
#include "nodes/verbs/show_verb.hpp"
#include "nodes/verbs/store_verb.hpp"
#include "nodes/verbs/sync_verb.hpp"

namespace {

using namespace afterglow::nodes;

/// The program of a verb that is not in here; nullptr for the others.
const char* programOf(const std::string& verb) {
  if (verb == "play") return "afterglow_play";
  if (verb == "render") return "afterglow_render";
  if (verb == "calibrate") return "afterglow_calibrate";
  return nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  char** verb = std::find_if(argv + 1, argv + argc, [](const char* word) { return *word != '-'; });
  const char* program = verb != argv + argc ? programOf(*verb) : nullptr;
  if (program) return becomeProgram(program, *verb, argv);
  // As --help lists them.
  return runCommand(argc, argv,
                    {addImportVerb, addListVerb, addShowVerb, addSaidVerb,
                     [](CLI::App& app) { app.add_subcommand("play", kPlayHelp); }, addExportVerb,
                     [](CLI::App& app) { app.add_subcommand("render", kRenderHelp); },
                     addStoreVerb, addSyncVerb,
                     [](CLI::App& app) { app.add_subcommand("calibrate", kCalibrateHelp); }});
}

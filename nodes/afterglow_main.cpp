// The command `afterglow`: knows its verbs by name and becomes the program of the one that is asked
// for, which lies beside it (nodes/verbs/command.hpp).
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

struct Verb {
  const char* name;
  const char* help;
  const char* program;
};

// As --help lists them.
constexpr Verb kVerbs[] = {
    {"import", kImportHelp, "afterglow_store"},
    {"list", kListHelp, "afterglow_store"},
    {"show", kShowHelp, "afterglow_store"},
    {"said", kSaidHelp, "afterglow_store"},
    {"play", kPlayHelp, "afterglow_play"},
    {"export", kExportHelp, "afterglow_store"},
    {"render", kRenderHelp, "afterglow_render"},
    {"store", kStoreHelp, "afterglow_store"},
    {"sync", kSyncHelp, "afterglow_store"},
    {"calibrate", kCalibrateHelp, "afterglow_calibrate"},
};

void addNames(CLI::App& app) {
  for (const Verb& verb : kVerbs) app.add_subcommand(verb.name, verb.help);
}

}  // namespace

int main(int argc, char** argv) {
  char** word = std::find_if(argv + 1, argv + argc, [](const char* text) { return *text != '-'; });
  for (const Verb& verb : kVerbs) {
    if (word != argv + argc && std::string(*word) == verb.name) {
      return becomeProgram(verb.program, verb.name, argv);
    }
  }
  return runCommand(argc, argv, {addNames});
}

// The command `afterglow`: one file a verb in nodes/verbs/. Exit status 0: done; 1: refused or
// failed, with one line on stderr; 2: wrong usage.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <string>

#include "nodes/verbs/calibrate_verb.hpp"
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

void addVerbs(CLI::App& app) {
  addImportVerb(app);
  addListVerb(app);
  addShowVerb(app);
  addSaidVerb(app);
  addPlayVerb(app);
  addExportVerb(app);
  addRenderVerb(app);
  addStoreVerb(app);
  addSyncVerb(app);
  addCalibrateVerb(app);
}

void printFailure(const CLI::App& app, std::string text) {
  for (char& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  std::cerr << "afterglow";
  for (auto verbs = app.get_subcommands(); !verbs.empty();
       verbs = verbs.front()->get_subcommands()) {
    std::cerr << " " << verbs.front()->get_name();
  }
  std::cerr << ": " << text << std::endl;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Records what a robot does, finds it again and replays it with its projection.",
               "afterglow");
  app.set_version_flag("--version", "afterglow " AFTERGLOW_VERSION);
  app.require_subcommand(1);
  addVerbs(app);
  try {
    app.parse(argc, argv);
    if (!std::cout.flush()) throw std::runtime_error("cannot write to standard output");
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;  // --help and --version come this way too
  } catch (const std::bad_alloc&) {
    printFailure(app, "not enough memory");
  } catch (const std::exception& error) {
    printFailure(app, error.what());
  }
  return 1;
}

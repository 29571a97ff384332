// The verbs of `afterglow` that need a store alone.
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/export_verb.hpp"
#include "nodes/verbs/import_verb.hpp"
#include "nodes/verbs/list_verb.hpp"
#include "nodes/verbs/said_verb.hpp"
#include "nodes/verbs/show_verb.hpp"
#include "nodes/verbs/store_verb.hpp"
#include "nodes/verbs/sync_verb.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  return runCommand(argc, argv,
                    {addImportVerb, addListVerb, addShowVerb, addSaidVerb, addExportVerb,
                     addStoreVerb, addSyncVerb});
}

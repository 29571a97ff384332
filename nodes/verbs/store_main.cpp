// The verbs of `afterglow` that need a store alone.
#include "nodes/verbs/command.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  return runCommand(argc, argv,
                    {addImportVerb, addInfoVerb, addListVerb, addShowVerb, addSaidVerb, addEditVerb,
                     addExportVerb, addStoreVerb, addSyncVerb});
}

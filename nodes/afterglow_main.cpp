// The command `afterglow`: becomes the program of the verb that is asked for (verbs/command.hpp).
#include <algorithm>

#include "nodes/verbs/command.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  char** word = std::find_if(argv + 1, argv + argc, [](const char* text) { return *text != '-'; });
  const char* program = word == argv + argc ? nullptr : programOf(*word);
  if (word != argv + argc && !program) return refuseVerb(*word);
  return program ? becomeProgram(program, *word, argv) : runCommand(argc, argv, {addVerbNames});
}

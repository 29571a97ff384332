// The command `afterglow`: becomes the program of the verb that is asked for (verbs/command.hpp).
#include <algorithm>
#include <string>

#include "nodes/verbs/command.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const auto nextWord = [argv, argc] {
    return std::find_if(argv + 1, argv + argc, [](const char* text) { return *text != '-'; });
  };
  char** word = nextWord();
  std::string help = "--help";
  if (word != argv + argc && *word == std::string("help")) {  // `help VERB` is `VERB --help`
    std::rotate(word, word + 1, argv + argc);
    argv[argc - 1] = help.data();
    word = nextWord();
  }
  const char* program = word == argv + argc ? nullptr : programOf(*word);
  if (word != argv + argc && !program) return refuseVerb(*word);
  return program ? becomeProgram(program, *word, argv) : runCommand(argc, argv, {addVerbNames});
}

// `afterglow console`, and the page of `afterglow show`.
#include "nodes/verbs/command.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  return runCommand(argc, argv, {addConsoleVerb, addShowPageVerb});
}

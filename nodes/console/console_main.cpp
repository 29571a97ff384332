// `afterglow console`.
#include "nodes/verbs/command.hpp"

int main(int argc, char** argv) {
  return afterglow::nodes::runCommand(argc, argv, {afterglow::nodes::addConsoleVerb});
}

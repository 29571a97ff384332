// The verbs that set a robot up, `afterglow doctor` and `init`.
#include "nodes/verbs/command.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  return runCommand(argc, argv, {addDoctorVerb, addInitVerb});
}

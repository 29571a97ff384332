/// \file
/// The command `afterglow`, which is several programs: what only some verbs need (ROS, OpenCV, the
/// renderer) takes ten times as long to load as the rest takes to list a store.
#pragma once

#include <CLI/App.hpp>
#include <vector>

namespace afterglow::nodes {

using AddVerb = void (*)(CLI::App&);

/// Parses the command line, does what its verb says and returns the exit status: 0 done; 1 refused
/// or failed, with one line on stderr; 2 wrong usage.
int runCommand(int argc, char** argv, const std::vector<AddVerb>& verbs);

/// Goes on as another program, which lies beside this one, for a verb, with the same arguments.
/// Returns (1, with one line on stderr) only if that cannot be started.
int becomeProgram(const char* name, const char* verb, char** argv);

}  // namespace afterglow::nodes

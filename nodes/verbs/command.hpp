/// \file
/// The command `afterglow`, which is several programs, since loading what some verbs need (ROS,
/// OpenCV, the renderer) takes ten times as long as others take to list a store. The one that is
/// called loads none of the libraries: libmongoc's counters in shared memory, which bear a process's
/// number, would be left behind.
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

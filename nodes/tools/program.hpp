/// \file
/// Other programs of this machine (ffmpeg, aplay), started without a shell.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace afterglow::nodes {

/// Whether a command of that name can be found on PATH.
bool hasProgram(const std::string& name);

/// Starts a program, found on PATH, with nothing to read; what it prints (standard output and
/// error) goes to `output_fd`. The caller waits for the process. Throws std::runtime_error naming
/// the program that cannot be started.
pid_t startProgram(const std::vector<std::string>& arguments, int output_fd);

struct ProgramResult {
  int status = 0;      ///< exit status; 128 + the signal's number if one ended it
  std::string output;  ///< standard output and error as they came
};

/// Runs a program to its end. Throws as startProgram does.
ProgramResult runProgram(const std::vector<std::string>& arguments);

}  // namespace afterglow::nodes

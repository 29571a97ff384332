/// \file
/// Other programs of this machine (ffmpeg, aplay, the watchdog), started without a shell, and work
/// that may hang or crash (drivers, displays, servers), done by a process of its own.
#pragma once

#include <sys/types.h>

#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace afterglow::nodes {

/// Returns true if a command of that name can be found: on PATH, or where its slashes say.
bool hasProgram(const std::string& name);

/// The start of a program: its standard streams, and whether it gets our group's signals.
struct ProgramStart {
  static constexpr int kNothing = -1;  ///< /dev/null
  static constexpr int kOurs = -2;     ///< our own stream
  int input = kNothing, output = kNothing, error = kNothing;
  /// Ctrl-C in a terminal signals a process group, closing the terminal a session.
  enum class Leader { None, OfGroup, OfSession } leader = Leader::None;
};

/// Starts a program, a path or a name on PATH. It inherits no other descriptors: roscpp's sockets
/// would stay open in it. The caller waits for the process. Throws std::system_error naming
/// the program that cannot be started.
pid_t startProgram(const std::vector<std::string>& arguments, const ProgramStart& start);
/// Starts a program with empty input, and all its output to `output_fd`.
pid_t startProgram(const std::vector<std::string>& arguments, int output_fd);

/// Waits until the program has ended; returns waitpid's status.
int waitForProgram(pid_t pid);

struct ProgramResult {
  int status = 0;      ///< exit status; 128 + the signal's number if one ended it
  std::string output;  ///< standard output and error as they came
};

/// Runs a program to its end. Throws as startProgram does.
ProgramResult runProgram(const std::vector<std::string>& arguments);

/// Runs programs, one after the other, that another thread can end.
class EndableProgram {
 public:
  /// Runs a program as runProgram does. Throws std::runtime_error after end().
  ProgramResult run(const std::vector<std::string>& arguments);
  /// Kills the program that runs; later ones are not started. Any thread.
  void end();

 private:
  pid_t start(const std::vector<std::string>& arguments, int output_fd);
  int waitFor(pid_t pid);

  std::mutex mutex_;
  pid_t pid_ = 0;  ///< number of a program that has not been waited for, so that it is no other's
  bool is_ended_ = false;
};

/// Forks, and returns what `work` returns there, at most 64 KiB. Throws std::runtime_error, one
/// line, with what `work` threw, with the signal that ended it, or if it has not ended within
/// `seconds`; then it is killed. To be called while this process has one thread.
std::string boundedWork(double seconds, const std::function<std::string()>& work);

}  // namespace afterglow::nodes

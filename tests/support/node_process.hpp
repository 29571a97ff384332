/// \file
/// A node under test in a process of its own, as it runs on a robot.
#pragma once

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "nodes/tools/program.hpp"

namespace afterglow::test {

/// Killed with the object, unless it has ended before.
class NodeProcess {
 public:
  explicit NodeProcess(const std::vector<std::string>& arguments)
      : log_(std::tmpfile()), pid_(nodes::startProgram(arguments, fileno(log_))) {}
  ~NodeProcess() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    std::fclose(log_);
  }
  NodeProcess(const NodeProcess&) = delete;
  NodeProcess& operator=(const NodeProcess&) = delete;

  void interrupt() const { signal(SIGINT); }
  void signal(int number) const { kill(pid_, number); }
  pid_t pid() const { return pid_; }
  bool hasEnded() const {
    siginfo_t told{};
    return waitid(P_PID, static_cast<id_t>(pid_), &told, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           told.si_pid != 0;
  }
  /// Waits for the end; -1 if a signal ended it.
  int exitStatus() {
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  /// What it printed so far.
  std::string log() const {
    std::string text(1 << 16, '\0');
    text.resize(static_cast<std::size_t>(
        std::max<ssize_t>(0, pread(fileno(log_), text.data(), text.size(), 0))));
    return text;
  }

 private:
  std::FILE* log_;
  pid_t pid_;
};

}  // namespace afterglow::test

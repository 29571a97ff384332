/// \file
/// A program on a terminal of its own, as a shell starts it: what it shows, and keys to press.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support/ros_master.hpp"

namespace afterglow::test {

/// Killed with the object, unless it has ended before.
class TerminalProcess {
 public:
  explicit TerminalProcess(std::vector<std::string> arguments)
      : screen_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    grantpt(screen_);
    unlockpt(screen_);
    const std::string path = ptsname(screen_);
    keys_ = open(path.c_str(), O_RDWR | O_NOCTTY);
    tcgetattr(keys_, &before_);
    std::vector<char*> words;
    for (std::string& word : arguments) words.push_back(word.data());
    words.push_back(nullptr);
    pid_ = fork();
    if (pid_ != 0) return;
    setsid();
    const int tty = open(path.c_str(), O_RDWR);
    for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) dup2(tty, fd);
    execv(words[0], words.data());
    _exit(127);
  }
  ~TerminalProcess() {
    if (pid_ > 0) kill(pid_, SIGKILL), waitpid(pid_, nullptr, 0);
    close(keys_);
    close(screen_);
  }
  TerminalProcess(const TerminalProcess&) = delete;
  TerminalProcess& operator=(const TerminalProcess&) = delete;

  void press(const std::string& keys) const {
    EXPECT_EQ(write(screen_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  void signal(int number) const { kill(pid_, number); }
  /// Whether it shows that, from now on or since it was asked last.
  bool shows(const std::string& text) {
    const bool is_seen = eventually([&] { return look().find(text) != std::string::npos; });
    EXPECT_TRUE(is_seen) << "'" << text << "' is not in: " << shown_;
    shown_.clear();
    return is_seen;
  }
  /// -1 if a signal ended it.
  int exitStatus() {
    int status = 0;
    const bool has_ended = eventually([&] { return look(), waitpid(pid_, &status, WNOHANG) != 0; });
    EXPECT_TRUE(has_ended);
    if (has_ended) pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  bool isAsBefore() const {
    termios now{};
    return tcgetattr(keys_, &now) == 0 && now.c_lflag == before_.c_lflag &&
           now.c_cc[VMIN] == before_.c_cc[VMIN];
  }
  const std::string& look() {
    char bytes[4096];
    for (ssize_t count; (count = read(screen_, bytes, sizeof(bytes))) > 0;) {
      shown_.append(bytes, static_cast<std::size_t>(count));
    }
    return shown_;
  }

 private:
  int screen_, keys_ = -1;
  pid_t pid_ = -1;
  termios before_{};
  std::string shown_;
};

}  // namespace afterglow::test

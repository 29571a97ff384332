/// \file
/// A server of a test's own on this machine: a free TCP port, and the process that listens there.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace afterglow::test {

inline sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

/// Below those that Linux gives to outgoing connections, so that none gets it before its server
/// listens, or while that starts again.
inline int freePort() {
  std::random_device chance;
  for (int attempt = 0; attempt < 1000; ++attempt) {
    const int port = std::uniform_int_distribution<int>(15000, 32000)(chance);
    const sockaddr_in address = loopback(port);
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    const bool is_free =
        bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    close(fd);
    if (is_free) return port;
  }
  throw std::runtime_error("no free port");
}

inline bool answers(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  const sockaddr_in address = loopback(port);
  const bool is_open =
      connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(fd);
  return is_open;
}

/// Ended by a signal when the object goes; a crashed test leaves no server behind.
class OwnServer {
 public:
  /// Starts the program and waits until it listens on `port`; throws std::runtime_error naming it
  /// if it does not. `end_signal` ends it.
  OwnServer(std::vector<std::string> arguments, int port, int end_signal)
      : arguments_(std::move(arguments)), port_(port), end_signal_(end_signal) {
    start();
  }
  ~OwnServer() { end(); }
  OwnServer(const OwnServer&) = delete;
  OwnServer& operator=(const OwnServer&) = delete;

  void end() {
    if (pid_ <= 0) return;
    kill(pid_, end_signal_);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }
  /// Again, on the same port.
  void start() {
    pid_ = fork();
    if (pid_ == 0) run();
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!answers(port_)) {
      if (std::chrono::steady_clock::now() > deadline || waitpid(pid_, nullptr, WNOHANG) == pid_) {
        throw std::runtime_error(arguments_.front() + " does not answer");
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  void signal(int number) const { kill(pid_, number); }

 private:
  [[noreturn]] void run() const {
    prctl(PR_SET_PDEATHSIG, end_signal_ == SIGKILL ? SIGKILL : SIGTERM);
    const int nowhere = open("/dev/null", O_RDWR);
    for (const int fd : {0, 1, 2}) dup2(nowhere, fd);
    std::vector<char*> words;
    for (const std::string& argument : arguments_)
      words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    execvp(words.front(), words.data());
    _exit(127);
  }

  std::vector<std::string> arguments_;
  int port_, end_signal_;
  pid_t pid_ = -1;
};

}  // namespace afterglow::test

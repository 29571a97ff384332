/// \file
/// A ROS master for one test program: its own roscore on a free port, gone when the program ends.
/// Also `eventually`, for waiting on the network without sleeping to be safe.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <ros/ros.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>

#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

/// Asks again until it holds or the time is up (generous: machines are loaded).
template <typename Condition>
bool eventually(const Condition& condition,
                std::chrono::milliseconds deadline = std::chrono::seconds(20)) {
  const auto end = std::chrono::steady_clock::now() + deadline;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

/// Make it before ros::init: it points this process, and those it starts, to the new master.
class RosMaster {
 public:
  RosMaster() {
    const std::string port = std::to_string(freePort());
    setenv("ROS_MASTER_URI", ("http://localhost:" + port).c_str(), 1);
    setenv("ROS_HOSTNAME", "localhost", 1);
    setenv("ROS_HOME", home_.path("ros").c_str(), 1);
    setenv("ROS_LOG_DIR", home_.path("ros").c_str(), 1);
    pid_ = fork();
    if (pid_ == 0) runRoscore(port);
    // ros::master reads the URI in ros::init, so the port itself is asked first.
    if (!eventually([&] { return answers(std::stoi(port)); }))
      throw std::runtime_error("roscore does not answer on port " + port);
  }
  ~RosMaster() {
    kill(pid_, SIGINT);  // it ends its children on this one
    waitpid(pid_, nullptr, 0);
  }
  RosMaster(const RosMaster&) = delete;
  RosMaster& operator=(const RosMaster&) = delete;

 private:
  static sockaddr_in loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    return address;
  }

  static int freePort() {
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof address;
    auto* raw = reinterpret_cast<sockaddr*>(&address);
    if (bind(fd, raw, size) != 0 || getsockname(fd, raw, &size) != 0)
      throw std::runtime_error("no free port");
    close(fd);
    return ntohs(address.sin_port);
  }

  static bool answers(int port) {
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    const sockaddr_in address = loopback(port);
    const bool is_open =
        connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    close(fd);
    return is_open;
  }

  [[noreturn]] static void runRoscore(const std::string& port) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);  // a crashed test leaves no master behind
    const int nowhere = open("/dev/null", O_RDWR);
    for (const int fd : {0, 1, 2}) dup2(nowhere, fd);
    execlp("roscore", "roscore", "-p", port.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }

  TempFolder home_;
  pid_t pid_ = -1;
};

}  // namespace afterglow::test

/// \file
/// A ROS master for one test program: its own roscore on a free port, gone when the program ends.
/// Also `eventually`, for waiting on the network without sleeping to be safe.
#pragma once

#include <ros/ros.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <string>
#include <thread>

#include "tests/support/own_server.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

/// How many times longer than usual things may take: tests/CMakeLists.txt says so.
inline int patience() {
  const char* factor = std::getenv("AFTERGLOW_TEST_PATIENCE");
  return factor == nullptr ? 1 : std::max(1, std::atoi(factor));
}

/// Asks again until it holds or the time is up (generous: machines are loaded).
template <typename Condition>
bool eventually(const Condition& condition,
                std::chrono::milliseconds deadline = std::chrono::seconds(20)) {
  const auto end = std::chrono::steady_clock::now() + patience() * deadline;
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
    setenv("ROS_MASTER_URI", ("http://localhost:" + std::to_string(port_)).c_str(), 1);
    setenv("ROS_HOSTNAME", "localhost", 1);
    setenv("ROS_HOME", home_.path("ros").c_str(), 1);
    setenv("ROS_LOG_DIR", home_.path("ros").c_str(), 1);
    // ros::master reads the URI in ros::init, so the port itself is asked until it answers.
    core_.emplace(std::vector<std::string>{"roscore", "-p", std::to_string(port_)}, port_,
                  SIGINT);  // it ends its children on this one
  }
  /// It dies, and no other comes.
  void end() { core_->end(); }
  /// Another one, which knows nothing, where the ended one was.
  void start() { core_->start(); }

 private:
  TempFolder home_;
  int port_ = freePort();
  std::optional<OwnServer> core_;
};

/// A master, and this process on its graph.
struct TestGraph {
  explicit TestGraph(const char* node = "test") {
    int argc = 0;
    ros::init(argc, nullptr, node, ros::init_options::NoSigintHandler);
  }
  RosMaster master;
};

}  // namespace afterglow::test

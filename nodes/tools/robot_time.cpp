#include "nodes/tools/robot_time.hpp"

#include <ros/ros.h>

#include <chrono>
#include <stdexcept>
#include <thread>

namespace afterglow::nodes {

std::string clockPublisher() {
  const auto others = askMaster(deadlineIn(kMasterPatience)).otherPublishers("/clock");
  return others.empty() ? "" : *others.begin();
}

void requireTime(Deadline deadline) {
  // roscpp looks only when a node begins.
  bool is_set = false;
  ros::param::get("/use_sim_time", is_set);
  if (is_set && !ros::Time::isSimTime()) {
    throw std::runtime_error(
        "/use_sim_time was set after this node had begun: its time is not the robot's; start it "
        "anew");
  }
  if (!ros::Time::isSimTime()) return;
  const std::string publisher = clockPublisher();
  if (publisher.empty()) {
    throw std::runtime_error(
        "/use_sim_time is set and nobody publishes /clock: the robot's time stands still");
  }
  while (ros::Time::now().isZero()) {
    if (std::chrono::steady_clock::now() >= deadline) {
      throw std::runtime_error("/use_sim_time is set and the /clock of " + publisher +
                               " says 0: the robot's time has not begun");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

}  // namespace afterglow::nodes

// simulated_robot NAME [mux]: a robot of robot_facts.hpp, or the multiplexer before its base, which
// is a node of its own there, too.
#include <ros/ros.h>

#include <iostream>
#include <string>
#include <vector>

#include "nodes/fetch/fake_switches.hpp"
#include "tests/support/robots/robot_facts.hpp"
#include "tests/support/robots/robot_node.hpp"
#include "tests/support/robots/twist_mux.hpp"

namespace {

void runMux(const afterglow::test::MuxFacts& facts) {
  if (!facts.locks.empty()) {
    const afterglow::test::TwistMux mux(facts);
    return ros::spin();
  }
  std::vector<std::string> inputs;
  for (const auto& input : facts.inputs) inputs.push_back(input.topic);
  const afterglow::nodes::VelocityMux mux(inputs);
  ros::spin();
}

}  // namespace

int main(int argc, char** argv) {
  const bool is_mux = argc == 3 && argv[2] == std::string("mux");
  ros::init(argc, argv, is_mux ? "mux" : "robot");
  try {
    const auto& facts = afterglow::test::factsOf(argc > 1 ? argv[1] : "");
    if (is_mux) {
      runMux(facts.mux.value());
      return 0;
    }
    const afterglow::test::RobotNode robot(facts);
    ros::spin();
  } catch (const std::exception& error) {
    std::cerr << "simulated_robot: " << error.what() << "\n";
    return 1;
  }
  return 0;
}

#include <ros/ros.h>

#include <exception>
#include <iostream>
#include <optional>

#include "nodes/player/stop_signal.hpp"
#include "nodes/projector/projector_node.hpp"
#include "nodes/projector/projector_window.hpp"
#include "nodes/tools/master_check.hpp"
#include "render/gl/window.hpp"

namespace {

using afterglow::nodes::ProjectorNode;
using afterglow::nodes::ProjectorNodeOptions;
using afterglow::render::Window;

constexpr char kTitle[] = "Afterglow projector";

bool goesOn(const ProjectorNode& node) {
  return ros::ok() && !afterglow::nodes::isStopRequested() && node.failure().empty();
}

/// Until somebody stops it. Windows belong to the main thread, so pictures are shown here.
void project(ProjectorNode& node, std::optional<Window> window) {
  while (goesOn(node)) {
    const auto picture = node.takePicture(std::chrono::milliseconds(50));
    if (!window) continue;
    if (picture) {
      window->show(*picture);
    } else {
      window->poll();
    }
    if (window->isClosed()) {
      ROS_INFO("the window is closed: projecting goes on without it");
      window.reset();
    }
  }
  if (window) window->show(node.black());
  node.stop();
}

}  // namespace

int main(int argc, char** argv) {
  try {
    afterglow::nodes::requireMaster(argc, argv);
    ros::init(argc, argv, "projector_node", ros::init_options::NoSigintHandler);
    afterglow::nodes::catchStopSignals();
    const ros::NodeHandle own("~");  // stays: with the last handle ROS shuts down
    const auto options = ProjectorNodeOptions::read(own);
    ProjectorNode node(options);
    auto window =
        afterglow::nodes::openWindow(options.window, kTitle, node.lens().width, node.lens().height);
    ros::AsyncSpinner spinner(1);
    spinner.start();
    project(node, std::move(window));
    afterglow::nodes::letMessagesLeave();
    spinner.stop();
    if (!node.failure().empty()) throw std::runtime_error("drawing failed: " + node.failure());
  } catch (const std::exception& error) {
    std::cerr << "projector_node: " << error.what() << "\n";
    return 1;
  }
  return 0;
}

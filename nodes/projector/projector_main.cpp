#include <ros/ros.h>

#include <exception>
#include <iostream>
#include <optional>

#include "nodes/player/stop_signal.hpp"
#include "nodes/projector/projector_node.hpp"
#include "nodes/tools/master_check.hpp"
#include "render/gl/window.hpp"

namespace {

using afterglow::nodes::ProjectorNode;
using afterglow::nodes::ProjectorNodeOptions;
using afterglow::nodes::WindowMode;
using afterglow::render::Window;

constexpr char kTitle[] = "Afterglow projector";

/// The projector's screen where it is told or plain to see, else a window to look at; none without
/// a display, unless one is demanded.
std::optional<Window> openWindow(const ProjectorNodeOptions& options,
                                 const afterglow::calib::Lens& lens) {
  if (options.window == WindowMode::Never) return std::nullopt;
  if (options.window == WindowMode::Always || !options.monitor.empty()) {
    return Window::fullScreen(options.monitor, kTitle, lens.width, lens.height);
  }
  if (!afterglow::render::hasDisplay()) {
    ROS_INFO("no display: projecting without a window");
    return std::nullopt;
  }
  try {
    const auto monitors = Window::monitors();
    const bool has_projector = monitors.size() > 1 && monitors.back().width == lens.width &&
                               monitors.back().height == lens.height;
    if (has_projector) return Window::fullScreen("", kTitle, lens.width, lens.height);
    return std::optional<Window>(std::in_place, kTitle, lens.width, lens.height);
  } catch (const std::runtime_error& error) {
    ROS_WARN("projecting without a window: %s", error.what());
    return std::nullopt;
  }
}

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
    auto window = openWindow(options, node.lens());
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

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "nodes/projector/projector_node.hpp"
#include "nodes/projector/projector_window.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "render/gl/window.hpp"

namespace {

using afterglow::nodes::ProjectorNode;
using afterglow::nodes::ProjectorNodeOptions;
using afterglow::nodes::ProjectorOutput;
using afterglow::render::Window;

/// A projector and its window, if it has one.
struct Screen {
  ProjectorOutput& output;
  std::optional<Window> window;
  std::string problem;  ///< problem of the window, as the output has been told
};

bool goesOn(const ProjectorNode& node) {
  return ros::ok() && !afterglow::nodes::isStopRequested() && node.failure().empty();
}

std::vector<Screen> openScreens(const ProjectorNode& node,
                                const afterglow::nodes::WindowChoice& choice) {
  std::vector<Screen> screens;
  const bool is_one_of_several = node.outputs().size() > 1;
  for (const auto& output : node.outputs()) {
    const std::string& name = output->config().name;
    const std::string& monitor = output->config().monitor;
    if (is_one_of_several && monitor.empty() &&
        choice.mode == afterglow::nodes::WindowMode::Always) {
      throw std::runtime_error("projector '" + name + "' needs a 'monitor'");
    }
    const std::string title = "Afterglow projector" + (name.empty() ? "" : " " + name);
    screens.push_back({*output,
                       afterglow::nodes::openWindow({choice.mode, monitor}, title,
                                                    output->lens().width, output->lens().height),
                       ""});
  }
  return screens;
}

void update(Screen& screen) {
  if (auto picture = screen.output.takePicture()) {
    screen.window->show(*picture);
    screen.output.giveBack(std::move(*picture));
  } else {
    screen.window->poll();
  }
  if (screen.window->isClosed()) {
    ROS_INFO("a window is closed: projecting goes on without it");
    screen.window.reset();
  }
  const std::string problem = screen.window ? screen.window->problem() : "";
  if (problem == screen.problem) return;
  screen.problem = problem;
  screen.output.setWindowProblem(problem);
}

/// Until somebody stops it. Windows belong to the main thread, so pictures are shown here. Screens
/// wait for each other's refresh: two at 60 Hz take pictures at 30 Hz or more.
void project(ProjectorNode& node, std::vector<Screen> screens) {
  while (goesOn(node)) {
    node.awaitPictures(std::chrono::milliseconds(50));
    for (Screen& screen : screens) {
      if (screen.window) update(screen);
    }
  }
  for (Screen& screen : screens) {
    if (screen.window) screen.window->show(screen.output.black());
  }
  node.stop();
}

}  // namespace

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const NodeText text{"projector_node", "projects what robots publish where it belongs.",
                      "projector.launch"};
  return runNode(argc, argv, text, [](const ros::NodeHandle& own, const auto&) {
    const auto options = ProjectorNodeOptions::read(own);
    ProjectorNode node(options);
    const Registration registration;
    auto screens = openScreens(node, options.window);
    ros::AsyncSpinner spinner(1);
    spinner.start();
    project(node, std::move(screens));
    letMessagesLeave();
    spinner.stop();
    if (!node.failure().empty()) throw std::runtime_error("drawing failed: " + node.failure());
  });
}

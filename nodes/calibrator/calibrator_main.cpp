#include <optional>
#include <stdexcept>
#include <string>

#include "nodes/calibrator/calibrator_node.hpp"
#include "nodes/projector/projector_window.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace afterglow::nodes {
namespace {

render::Image inColor(const calib::Picture& picture) {
  render::Image image{picture.width, picture.height, {}};
  image.rgb.reserve(3 * picture.pixels.size());
  for (const std::uint8_t gray : picture.pixels) image.rgb.insert(image.rgb.end(), 3, gray);
  return image;
}

/// Shows the node's picture, mirrored if the options say so, until a stop is requested; then stops
/// the node: the window's last picture is black. Throws std::runtime_error if a window is demanded
/// and there can be none.
void showUntilStopped(CalibratorNode& node, const CalibratorOptions& options) {
  PatternScreen& screen = node.screen();
  auto window =
      openWindow(options.window, "Afterglow calibration", screen.width(), screen.height());
  const render::LightOutput mirror({{}, 1, options.mirror});
  if (window && !window->problem().empty()) throw std::runtime_error(window->problem());
  const auto show = [&](const calib::Picture& picture) {
    render::Image image = inColor(picture);
    mirror.apply(image);
    window->show(image);
  };
  std::string problem;  // as told
  while (ros::ok() && !isStopRequested()) {
    const auto picture = screen.takeChanged(std::chrono::milliseconds(50));
    if (!window) continue;
    if (picture) {
      show(*picture);
    } else {
      window->poll();
    }
    if (window->problem() != problem) {
      problem = window->problem();
      if (!problem.empty()) node.tell(problem);
    }
    if (window->isClosed()) {
      node.tell("the projector's window is closed: only ~pattern has the picture now");
      window.reset();
    }
  }
  node.stop();
  if (!window) return;
  if (const auto black = screen.takeChanged(std::chrono::milliseconds(0))) {
    show(*black);
  }
}

}  // namespace
}  // namespace afterglow::nodes

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const NodeText text{"calibrator_node", "calibrates a projector with a camera.",
                      "calibrator.launch"};
  return runNode(argc, argv, text, [](const ros::NodeHandle& own, const auto&) {
    const CalibratorOptions options = CalibratorOptions::read(own);
    CalibratorNode node(options);
    ros::AsyncSpinner spinner(1);
    spinner.start();
    showUntilStopped(node, options);
    letMessagesLeave();
    spinner.stop();
  });
}

#include "nodes/calibrator/calibrator_window.hpp"

#include <optional>
#include <stdexcept>

#include "nodes/player/stop_signal.hpp"
#include "nodes/projector/projector_window.hpp"

namespace afterglow::nodes {
namespace {

render::Image inColor(const calib::Picture& picture) {
  render::Image image{picture.width, picture.height, {}};
  image.rgb.reserve(3 * picture.pixels.size());
  for (const std::uint8_t grey : picture.pixels) image.rgb.insert(image.rgb.end(), 3, grey);
  return image;
}

}  // namespace

void showUntilStopped(CalibratorNode& node, const WindowChoice& choice) {
  PatternScreen& screen = node.screen();
  auto window = openWindow(choice, "Afterglow calibration", screen.width(), screen.height());
  if (window && !window->problem().empty()) throw std::runtime_error(window->problem());
  while (ros::ok() && !isStopRequested()) {
    const auto picture = screen.takeChanged(std::chrono::milliseconds(50));
    if (!window) continue;
    if (picture) {
      window->show(inColor(*picture));
    } else {
      window->poll();
    }
    if (window->isClosed()) {
      node.tell("the projector's window is closed: only ~pattern has the picture now");
      window.reset();
    }
  }
  node.stop();
  if (!window) return;
  if (const auto black = screen.takeChanged(std::chrono::milliseconds(0))) {
    window->show(inColor(*black));
  }
}

}  // namespace afterglow::nodes

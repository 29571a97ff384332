#include "nodes/calibrator/pattern_window.hpp"

#include <chrono>
#include <optional>
#include <stdexcept>

#include "nodes/projector/projector_window.hpp"

namespace afterglow::nodes {
namespace {

render::Image inColor(const calib::Picture& picture) {
  render::Image image{picture.width, picture.height, {}};
  image.rgb.reserve(3 * picture.pixels.size());
  for (const std::uint8_t gray : picture.pixels) image.rgb.insert(image.rgb.end(), 3, gray);
  return image;
}

}  // namespace

void PatternWindow::show(PatternScreen& screen) const {
  auto window = openWindow(choice, "Afterglow calibration", screen.width(), screen.height());
  const render::LightOutput output({{}, 1, mirror});
  if (window && !window->problem().empty()) throw std::runtime_error(window->problem());
  const auto showPicture = [&](const calib::Picture& picture) {
    render::Image image = inColor(picture);
    output.apply(image);
    window->show(image);
  };
  std::string problem;  // as told
  while (goes_on()) {
    const auto picture = screen.takeChanged(std::chrono::milliseconds(50));
    if (!window) continue;
    if (picture) {
      showPicture(*picture);
    } else {
      window->poll();
    }
    if (window->problem() != problem) {
      problem = window->problem();
      if (!problem.empty()) tell(problem);
    }
    if (window->isClosed()) {
      tell("the projector's window is closed: only the topic has the picture now");
      window.reset();
    }
  }
  stop();
  if (!window) return;
  if (const auto black = screen.takeChanged(std::chrono::milliseconds(0))) showPicture(*black);
}

}  // namespace afterglow::nodes

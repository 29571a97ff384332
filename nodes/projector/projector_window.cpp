#include "nodes/projector/projector_window.hpp"

#include <ros/console.h>

#include <stdexcept>
#include <utility>

namespace afterglow::nodes {

using render::Window;

std::optional<Window> openWindow(const WindowChoice& choice, const std::string& title, int width,
                                 int height) {
  if (choice.mode == WindowMode::Never) return std::nullopt;
  if (choice.mode == WindowMode::Always || !choice.monitor.empty()) {
    return Window::fullScreen(choice.monitor, title, width, height);
  }
  if (!render::hasDisplay()) {
    ROS_INFO("no display: projecting without a window");
    return std::nullopt;
  }
  try {
    const auto monitors = Window::monitors();
    const bool has_projector =
        monitors.size() > 1 && monitors.back().width == width && monitors.back().height == height;
    if (has_projector) return Window::fullScreen("", title, width, height);
    return std::optional<Window>(std::in_place, title, width, height);
  } catch (const std::runtime_error& error) {
    ROS_WARN("projecting without a window: %s", error.what());
    return std::nullopt;
  }
}

}  // namespace afterglow::nodes

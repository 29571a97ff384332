/// \file
/// The window a node shows its pictures in: the projector's screen, or one to look at.
#pragma once

#include <optional>
#include <string>

#include "nodes/tools/window_choice.hpp"
#include "render/gl/window.hpp"

namespace afterglow::nodes {

/// Opens a window on the projector's screen where that is told or plain to see (Window::problem()
/// says why it is not there yet), else a window to look at; none without a display, unless one is
/// demanded: then std::runtime_error says why there is none.
std::optional<render::Window> openWindow(const WindowChoice& choice, const std::string& title,
                                         int width, int height);

}  // namespace afterglow::nodes

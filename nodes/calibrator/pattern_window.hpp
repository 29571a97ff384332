/// \file
/// The window of a pattern screen.
#pragma once

#include <functional>
#include <string>

#include "nodes/calibrator/pattern_screen.hpp"
#include "nodes/tools/window_choice.hpp"
#include "render/light_output.hpp"

namespace afterglow::nodes {

/// Shows the screen's picture as long as `goes_on` says, then calls `stop`, which leaves the
/// screen's last picture. `tell` gets the window's problems, for people. To be called by the main
/// thread. Throws std::runtime_error if a window is demanded and there can be none.
struct PatternWindow {
  WindowChoice choice;
  render::Mirror mirror = render::Mirror::None;
  std::function<bool()> goes_on;
  std::function<void(const std::string&)> tell;
  std::function<void()> stop;

  void show(PatternScreen& screen) const;
};

}  // namespace afterglow::nodes

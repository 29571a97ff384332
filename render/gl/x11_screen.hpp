/// \file
/// Functions of X that GLFW lacks. Main thread, after GLFW's start.
#pragma once

#include <string>

struct GLFWmonitor;
struct GLFWwindow;

namespace afterglow::render {

/// Returns the monitor's own name in its EDID; empty: it has none.
std::string monitorModel(GLFWmonitor* monitor);

/// Hides a window that has not been shown yet from window managers: from now on none places,
/// decorates, stacks it or gives it the focus; it lies where it is put, even when monitors come and
/// go.
void hideFromWindowManager(GLFWwindow* window);

}  // namespace afterglow::render

/// \file
/// Functions of X that GLFW lacks. Main thread, after GLFW's start.
#pragma once

#include <string>

struct GLFWmonitor;
struct GLFWwindow;

namespace afterglow::render {

/// As the monitor calls itself in its EDID; empty: it does not.
std::string monitorModel(GLFWmonitor* monitor);

/// From now on no window manager places, decorates, stacks or gives the focus to a window that has
/// not been shown yet: it lies where it is put, even when monitors come and go.
void hideFromWindowManager(GLFWwindow* window);

}  // namespace afterglow::render

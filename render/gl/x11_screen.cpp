#include "render/gl/x11_screen.hpp"

#define GLFW_INCLUDE_NONE
#define GLFW_EXPOSE_NATIVE_X11
#include <GLFW/glfw3.h>
#include <GLFW/glfw3native.h>

#include <cstdint>
#include <vector>

#include "render/gl/monitor_choice.hpp"

namespace afterglow::render {

std::string monitorModel(GLFWmonitor* monitor) {
  Display* display = glfwGetX11Display();
  const Atom property = XInternAtom(display, "EDID", True);
  if (property == None) return {};
  constexpr long kWords = 32;  // 128 bytes, the block with the name
  Atom type = None;
  int bits = 0;
  unsigned long count = 0, rest = 0;
  unsigned char* bytes = nullptr;
  // An output may be gone by now, and Xlib ends programs for less.
  const auto handler = XSetErrorHandler([](Display*, XErrorEvent*) { return 0; });
  const int fault =
      XRRGetOutputProperty(display, glfwGetX11Monitor(monitor), property, 0, kWords, False, False,
                           AnyPropertyType, &type, &bits, &count, &rest, &bytes);
  XSetErrorHandler(handler);
  const bool is_there = fault == Success && bytes != nullptr && bits == 8;
  const std::vector<std::uint8_t> edid(bytes, is_there ? bytes + count : bytes);
  if (bytes != nullptr) XFree(bytes);
  return edidModel(edid);
}

void hideFromWindowManager(GLFWwindow* window) {
  XSetWindowAttributes attributes = {};
  attributes.override_redirect = True;
  XChangeWindowAttributes(glfwGetX11Display(), glfwGetX11Window(window), CWOverrideRedirect,
                          &attributes);
}

}  // namespace afterglow::render

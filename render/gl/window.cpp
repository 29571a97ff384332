#include "render/gl/window.hpp"

#include <epoxy/gl.h>
// After epoxy, which brings OpenGL's declarations.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <cstdlib>
#include <optional>
#include <stdexcept>

#include "render/gl/gl_handle.hpp"

namespace afterglow::render {
namespace {

std::string glfwError() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown error";
}

/// GLFW, started and ended. Nested starts do nothing; the count ends it with the last.
class Glfw {
 public:
  Glfw() {
    if (!hasDisplay()) throw std::runtime_error("no display: DISPLAY is not set");
    if (users++ == 0 && glfwInit() != GLFW_TRUE) {
      --users;
      throw std::runtime_error("cannot reach the display: " + glfwError());
    }
  }
  ~Glfw() {
    if (--users == 0) glfwTerminate();
  }
  Glfw(const Glfw&) = delete;
  Glfw& operator=(const Glfw&) = delete;

 private:
  static int users;  // GLFW's state is the process's own; main thread only
};
int Glfw::users = 0;

struct ListedMonitor {
  GLFWmonitor* handle;
  Monitor values;
};

std::vector<ListedMonitor> listMonitors() {
  int count = 0;
  GLFWmonitor** handles = glfwGetMonitors(&count);
  std::vector<ListedMonitor> all;
  for (int i = 0; i < count; ++i) {
    const GLFWvidmode* mode = glfwGetVideoMode(handles[i]);
    if (mode == nullptr) continue;
    all.push_back({handles[i], {glfwGetMonitorName(handles[i]), mode->width, mode->height}});
  }
  return all;
}

std::string sizeText(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

std::string listText(const std::vector<ListedMonitor>& monitors) {
  std::string text;
  for (std::size_t i = 0; i < monitors.size(); ++i) {
    const Monitor& monitor = monitors[i].values;
    text += (i == 0 ? "" : ", ") + std::to_string(i) + " '" + monitor.name + "' " +
            sizeText(monitor.width, monitor.height);
  }
  return text.empty() ? "none" : text;
}

/// GLFW lists the primary monitor first.
ListedMonitor findMonitor(const std::string& wanted) {
  const std::vector<ListedMonitor> all = listMonitors();
  if (wanted.empty() && !all.empty()) return all.back();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (wanted == all[i].values.name || wanted == std::to_string(i)) return all[i];
  }
  throw std::runtime_error("no monitor '" + wanted + "'; there are: " + listText(all));
}

struct WindowDeleter {
  void operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }
};

}  // namespace

bool hasDisplay() {
  const auto isSet = [](const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr && *value != '\0';
  };
  return isSet("DISPLAY") || isSet("WAYLAND_DISPLAY");
}

struct Window::Impl {
  Glfw glfw;
  std::unique_ptr<GLFWwindow, WindowDeleter> window;
  Texture texture;  // before the window is gone, these are
  Framebuffer framebuffer;
  int width = 0, height = 0;

  Impl(const std::string& title, int wanted_width, int wanted_height, const std::string* monitor)
      : width(wanted_width), height(wanted_height) {
    GLFWmonitor* screen = nullptr;
    if (monitor != nullptr) screen = checkedMonitor(*monitor);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
    glfwWindowHint(GLFW_AUTO_ICONIFY, GLFW_FALSE);  // stays when the operator clicks elsewhere
    glfwWindowHint(GLFW_FOCUSED, screen == nullptr ? GLFW_TRUE : GLFW_FALSE);
    window.reset(glfwCreateWindow(width, height, title.c_str(), screen, nullptr));
    if (!window) throw std::runtime_error("cannot open a window: " + glfwError());
    if (screen != nullptr) glfwSetInputMode(window.get(), GLFW_CURSOR, GLFW_CURSOR_HIDDEN);
    makePicture();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (window) glfwMakeContextCurrent(window.get());
  }

  GLFWmonitor* checkedMonitor(const std::string& name) const {
    const ListedMonitor found = findMonitor(name);
    if (found.values.width != width || found.values.height != height) {
      throw std::runtime_error("monitor '" + found.values.name + "' is set to " +
                               sizeText(found.values.width, found.values.height) +
                               " but the projector's lens is for " + sizeText(width, height) +
                               ": set the output to that resolution");
    }
    return found.handle;
  }

  void makePicture() {
    glfwMakeContextCurrent(window.get());
    glfwSwapInterval(1);
    texture = Texture::make(GLenum{GL_TEXTURE_2D});
    glTextureStorage2D(texture.id(), 1, GL_RGB8, width, height);
    framebuffer = Framebuffer::make();
    glNamedFramebufferTexture(framebuffer.id(), GL_COLOR_ATTACHMENT0, texture.id(), 0);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  }
};

Window::Window(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Window::Window(const std::string& title, int width, int height)
    : impl_(std::make_unique<Impl>(title, width, height, nullptr)) {}
Window Window::fullScreen(const std::string& monitor, const std::string& title, int width,
                          int height) {
  return Window(std::make_unique<Impl>(title, width, height, &monitor));
}
Window::Window(Window&&) noexcept = default;
Window::~Window() = default;

std::vector<Monitor> Window::monitors() {
  const Glfw glfw;
  std::vector<Monitor> monitors;
  for (const ListedMonitor& listed : listMonitors()) monitors.push_back(listed.values);
  return monitors;
}

void Window::show(const Image& image) {
  if (image.width != impl_->width || image.height != impl_->height) {
    throw std::invalid_argument("a picture of " + sizeText(image.width, image.height) +
                                " in a window of " + sizeText(impl_->width, impl_->height));
  }
  glfwMakeContextCurrent(impl_->window.get());
  glTextureSubImage2D(impl_->texture.id(), 0, 0, 0, image.width, image.height, GL_RGB,
                      GL_UNSIGNED_BYTE, image.rgb.data());
  int width = 0, height = 0;  // differs from the picture's only where the desktop scales windows
  glfwGetFramebufferSize(impl_->window.get(), &width, &height);
  // Pictures come from the top, OpenGL's windows from the bottom: the copy turns them over.
  glBlitNamedFramebuffer(impl_->framebuffer.id(), 0, 0, 0, image.width, image.height, 0, height,
                         width, 0, GL_COLOR_BUFFER_BIT, GL_LINEAR);
  glfwSwapBuffers(impl_->window.get());
  poll();
}

void Window::poll() {
  glfwPollEvents();
  if (glfwGetKey(impl_->window.get(), GLFW_KEY_ESCAPE) == GLFW_PRESS) {
    glfwSetWindowShouldClose(impl_->window.get(), GLFW_TRUE);
  }
}

bool Window::isClosed() const { return glfwWindowShouldClose(impl_->window.get()) != 0; }

}  // namespace afterglow::render

#include "render/gl/window.hpp"

#include <epoxy/gl.h>
// After epoxy, which brings OpenGL's declarations.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <chrono>
#include <optional>
#include <stdexcept>
#include <utility>

#include "render/gl/gl_handle.hpp"
#include "render/gl/x11_screen.hpp"

namespace afterglow::render {
namespace {

std::string glfwError() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "unknown error";
}

unsigned monitor_events = 0;  // came or went; GLFW's state is the process's own; main thread only

/// GLFW, started and ended. Nested starts do nothing; the count ends it with the last.
class Glfw {
 public:
  Glfw() {
    if (!hasDisplay()) throw std::runtime_error("no display: DISPLAY is not set");
    if (users++ == 0 && glfwInit() != GLFW_TRUE) {
      --users;
      throw std::runtime_error("cannot reach the display: " + glfwError());
    }
    glfwSetMonitorCallback([](GLFWmonitor*, int) { ++monitor_events; });
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

/// GLFW lists the primary monitor first.
std::vector<Monitor> listMonitors() {
  int count = 0;
  GLFWmonitor** handles = glfwGetMonitors(&count);
  std::vector<Monitor> all;
  for (int i = 0; i < count; ++i) {
    const GLFWvidmode* mode = glfwGetVideoMode(handles[i]);
    if (mode == nullptr) continue;
    Monitor monitor{
        glfwGetMonitorName(handles[i]), monitorModel(handles[i]), 0, 0, mode->width, mode->height};
    glfwGetMonitorPos(handles[i], &monitor.x, &monitor.y);
    all.push_back(std::move(monitor));
  }
  return all;
}

struct WindowDeleter {
  void operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }
};

}  // namespace

struct Window::Impl {
  using Clock = std::chrono::steady_clock;

  Glfw glfw;
  std::unique_ptr<GLFWwindow, WindowDeleter> window;
  Texture texture;  // before the window is gone, these are
  Framebuffer framebuffer;
  int width = 0, height = 0;

  bool is_plain = true;
  std::string monitor;            ///< wanted; once shown, its connector
  std::optional<Monitor> screen;  ///< monitor where it is shown
  std::string problem;
  Clock::time_point placed_at;
  unsigned seen_events = 0;

  /// `wanted`: the monitor for full screen, or nullptr.
  Impl(const std::string& title, int wanted_width, int wanted_height, const std::string* wanted)
      : width(wanted_width), height(wanted_height), is_plain(wanted == nullptr) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
    glfwWindowHint(GLFW_VISIBLE, is_plain ? GLFW_TRUE : GLFW_FALSE);
    glfwWindowHint(GLFW_DECORATED, is_plain ? GLFW_TRUE : GLFW_FALSE);
    glfwWindowHint(GLFW_FOCUS_ON_SHOW, is_plain ? GLFW_TRUE : GLFW_FALSE);
    window.reset(glfwCreateWindow(width, height, title.c_str(), nullptr, nullptr));
    if (!window) throw std::runtime_error("cannot open a window: " + glfwError());
    makeImage();
    if (is_plain) return;
    // Not GLFW's full screen: that moves onto another monitor when its own is gone, centers the
    // mouse, and leaves placing and focus to the window manager.
    hideFromWindowManager(window.get());
    glfwSetInputMode(window.get(), GLFW_CURSOR, GLFW_CURSOR_HIDDEN);
    monitor = *wanted;
    place();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (window) glfwMakeContextCurrent(window.get());
  }

  void makeImage() {
    glfwMakeContextCurrent(window.get());
    glfwSwapInterval(1);
    texture = Texture::make(GLenum{GL_TEXTURE_2D});
    glTextureStorage2D(texture.id(), 1, GL_RGB8, width, height);
    glClearTexImage(texture.id(), 0, GL_RGB, GL_UNSIGNED_BYTE, nullptr);  // black
    framebuffer = Framebuffer::make();
    glNamedFramebufferTexture(framebuffer.id(), GL_COLOR_ATTACHMENT0, texture.id(), 0);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  }

  /// Onto its monitor, or off the screen where that is not there.
  void place() {
    placed_at = Clock::now();
    const std::vector<Monitor> all = listMonitors();
    MonitorChoice choice = chooseMonitor(all, monitor, width, height);
    problem = std::move(choice.problem);
    if (!choice.monitor) {
      glfwHideWindow(window.get());
      screen.reset();
      return;
    }
    const Monitor& chosen = all[*choice.monitor];
    if (screen && screen->x == chosen.x && screen->y == chosen.y) return;
    monitor = chosen.name;
    screen = chosen;
    glfwSetWindowPos(window.get(), chosen.x, chosen.y);
    glfwShowWindow(window.get());
    present();
  }

  void present() {
    if (!is_plain && !screen) return;  // nobody sees it
    glfwMakeContextCurrent(window.get());
    int shown_width = 0, shown_height = 0;  // differ from the image's where windows are scaled
    glfwGetFramebufferSize(window.get(), &shown_width, &shown_height);
    // Images come from the top, OpenGL's windows from the bottom: the copy turns them over.
    glBlitNamedFramebuffer(framebuffer.id(), 0, 0, 0, width, height, 0, shown_height, shown_width,
                           0, GL_COLOR_BUFFER_BIT, GL_LINEAR);
    glfwSwapBuffers(window.get());
  }

  void poll() {
    glfwPollEvents();
    if (glfwGetKey(window.get(), GLFW_KEY_ESCAPE) == GLFW_PRESS) {
      glfwSetWindowShouldClose(window.get(), GLFW_TRUE);
    }
    // Monitors also move without coming or going, which GLFW does not tell.
    const bool is_due =
        monitor_events != seen_events || Clock::now() - placed_at > std::chrono::milliseconds(250);
    seen_events = monitor_events;
    if (!is_plain && is_due) place();
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
  return listMonitors();
}

void Window::show(const Image& image) {
  if (image.width != impl_->width || image.height != impl_->height) {
    throw std::invalid_argument(fmt::format("a picture of {}x{} in a window of {}x{}", image.width,
                                            image.height, impl_->width, impl_->height));
  }
  glfwMakeContextCurrent(impl_->window.get());
  glTextureSubImage2D(impl_->texture.id(), 0, 0, 0, image.width, image.height, GL_RGB,
                      GL_UNSIGNED_BYTE, image.rgb.data());
  impl_->present();
  impl_->poll();
}

void Window::poll() { impl_->poll(); }
bool Window::isClosed() const { return glfwWindowShouldClose(impl_->window.get()) != 0; }
const std::string& Window::problem() const { return impl_->problem; }

}  // namespace afterglow::render

/// \file
/// Windows that show finished images pixel by pixel: full screen on projectors, or a plain one to
/// look at.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/gl/monitor_choice.hpp"
#include "render/scene/image.hpp"

namespace afterglow::render {

/// A window on a screen. Make, use and destroy all of a process's in the main thread, which no
/// other OpenGL context may share. Needs X, or Xwayland.
class Window {
 public:
  /// A window of the images' size, with a border. Throws std::runtime_error if there is no display
  /// or it cannot do OpenGL.
  Window(const std::string& title, int width, int height);
  /// Full screen on the monitor that chooseMonitor finds, as soon and as long as it is there; once
  /// shown it stays true to that connector. Else it is hidden, and problem() says why. It never
  /// takes the focus, and no window manager moves it to another screen. Throws like the other.
  static Window fullScreen(const std::string& monitor, const std::string& title, int width,
                           int height);
  Window(Window&&) noexcept;
  ~Window();

  /// Shows an image of the window's size (std::invalid_argument for another) and handles the
  /// window's events. Returns when the screen has taken it.
  void show(const Image& image);
  /// Events without an image; to be called a few times a second, for monitors come and go.
  void poll();
  /// Somebody has closed it, or pressed Escape.
  bool isClosed() const;
  /// The reason why it is not on its screen now; empty: it is.
  const std::string& problem() const;

  /// The monitors there are, the primary one first. Throws std::runtime_error if there is no
  /// display.
  static std::vector<Monitor> monitors();

 private:
  struct Impl;
  explicit Window(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::render

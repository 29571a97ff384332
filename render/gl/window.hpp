/// \file
/// A window that shows finished pictures pixel by pixel: full screen on a projector, or a plain one
/// to look at.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/gl/renderer.hpp"

namespace afterglow::render {

/// One screen as the desktop has it.
struct Monitor {
  std::string name;  ///< as the desktop calls it; often the output ("HDMI-1"), sometimes the model
  int width = 0, height = 0;  ///< px, now
};

/// Whether this process may open windows: an X or Wayland display is named in the environment.
bool hasDisplay();

/// The windowing system's connection and one window. Make it, use it and destroy it in the main
/// thread, which no other OpenGL context may share. One at a time in a process.
class Window {
 public:
  /// A window of the pictures' size, with a frame. Throws std::runtime_error if there is no display
  /// or it cannot do OpenGL.
  Window(const std::string& title, int width, int height);
  /// Full screen on a monitor, by index ("0") or name; empty: the last that is not the primary one,
  /// else the only one. Throws std::runtime_error listing the monitors if there is none of that
  /// name, and if its resolution is not that of the pictures: light would land elsewhere.
  static Window fullScreen(const std::string& monitor, const std::string& title, int width,
                           int height);
  Window(Window&&) noexcept;
  ~Window();

  /// Shows a picture of the window's size (std::invalid_argument for another) and handles the
  /// window's events. Returns when the screen has taken it.
  void show(const Image& image);
  /// Events without a picture.
  void poll();
  /// Somebody has closed it, or pressed Escape.
  bool isClosed() const;

  /// The monitors there are. Throws std::runtime_error if there is no display.
  static std::vector<Monitor> monitors();

 private:
  struct Impl;
  explicit Window(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::render

/// \file
/// The full-screen window of a node: parameters ~window (auto, true, false) and ~monitor
/// (connector, model or index).
#pragma once

#include <ros/node_handle.h>

#include <string>

namespace afterglow::nodes {

enum class WindowMode { Auto, Always, Never };

struct WindowChoice {
  WindowMode mode = WindowMode::Auto;
  std::string monitor;

  /// Throws std::runtime_error naming the parameter that is wrong.
  static WindowChoice read(const ros::NodeHandle& own);
};

}  // namespace afterglow::nodes

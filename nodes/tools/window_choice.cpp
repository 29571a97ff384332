#include "nodes/tools/window_choice.hpp"

#include <XmlRpcValue.h>

#include <stdexcept>

namespace afterglow::nodes {
namespace {

/// roslaunch turns "true" into a boolean; both are taken.
WindowMode readMode(const ros::NodeHandle& own) {
  XmlRpc::XmlRpcValue value;
  if (!own.getParam("window", value)) return WindowMode::Auto;
  if (value.getType() == XmlRpc::XmlRpcValue::TypeBoolean) {
    return static_cast<bool>(value) ? WindowMode::Always : WindowMode::Never;
  }
  if (value.getType() == XmlRpc::XmlRpcValue::TypeString) {
    const std::string text = static_cast<std::string>(value);
    if (text == "auto") return WindowMode::Auto;
    if (text == "true") return WindowMode::Always;
    if (text == "false") return WindowMode::Never;
  }
  throw std::runtime_error("parameter ~window should be auto, true or false");
}

std::string readMonitor(const ros::NodeHandle& own) {
  XmlRpc::XmlRpcValue value;
  if (!own.getParam("monitor", value)) return {};
  if (value.getType() == XmlRpc::XmlRpcValue::TypeInt) {
    return std::to_string(static_cast<int>(value));
  }
  if (value.getType() == XmlRpc::XmlRpcValue::TypeString) return static_cast<std::string>(value);
  throw std::runtime_error("parameter ~monitor should be a monitor's index or name");
}

}  // namespace

WindowChoice WindowChoice::read(const ros::NodeHandle& own) {
  return {readMode(own), readMonitor(own)};
}

}  // namespace afterglow::nodes

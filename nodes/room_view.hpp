/// \file
/// A bystander's place in a room, and the room's own floor and walls. One YAML file;
/// assets/demo/view.yaml explains every key.
#pragma once

#include <string>
#include <vector>

#include "render/gl/renderer.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::nodes {

struct RoomView {
  std::string fixed_frame;
  render::ObserverView view;            ///< World is the fixed frame
  std::vector<render::Drawable> shell;  ///< floor and walls
};

/// Throws std::runtime_error "FILE:LINE: what is wrong" for a key that is unknown, missing or given
/// twice, and for a value of the wrong type or out of range.
RoomView loadRoomView(const std::string& path);

}  // namespace afterglow::nodes

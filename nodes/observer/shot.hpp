/// \file
/// What is to be seen at one moment, kept until there is time to draw it, and how it is drawn.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "nodes/observer/caption.hpp"
#include "nodes/observer/room_view.hpp"
#include "render/gl/observer_renderer.hpp"

namespace afterglow::nodes {

/// An image as runs of equal pixels. A projector's image, mostly black, takes little.
class PackedImage {
 public:
  PackedImage() = default;
  explicit PackedImage(const render::Image& image);
  render::Image unpacked() const;

 private:
  struct Run {
    std::uint32_t count;
    std::array<std::uint8_t, 3> pixel;
  };
  int width_ = 0, height_ = 0;
  std::vector<Run> runs_;
};

struct Shot {
  std::int64_t ros_ns = 0;
  std::vector<render::Drawable> solids;
  std::optional<render::ProjectedLight> light;  ///< its image, if it is empty, is in packed_light
  PackedImage packed_light;
  Look look;
  Caption caption;
  std::vector<std::string> key_frames = {};  ///< names to save it by
  render::Image projected = {};              ///< for the key frames; empty: none
  bool is_filmed = false;
};

/// What a film shows: the room as a bystander sees it, width x height pixels, with the projector's
/// image in a corner (`has_inset`), and the caption in a strip below. Unpacks the shot's light. The
/// renderer's thread; throws std::logic_error as the renderer does.
render::Image paintShot(Shot& shot, render::ObserverRenderer& renderer, CaptionPainter& painter,
                        int width, int height, bool has_inset);

}  // namespace afterglow::nodes

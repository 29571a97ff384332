#include "nodes/observer/shot.hpp"

#include <algorithm>

namespace afterglow::nodes {

PackedImage::PackedImage(const render::Image& image)
    : width_(image.width), height_(image.height) {
  for (std::size_t i = 0; i + 2 < image.rgb.size(); i += 3) {
    const std::array<std::uint8_t, 3> pixel = {image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]};
    if (runs_.empty() || runs_.back().pixel != pixel) runs_.push_back({0, pixel});
    ++runs_.back().count;
  }
}

render::Image PackedImage::unpacked() const {
  render::Image image{width_, height_, {}};
  image.rgb.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3);
  for (const Run& run : runs_) {
    for (std::uint32_t i = 0; i < run.count; ++i) {
      image.rgb.insert(image.rgb.end(), run.pixel.begin(), run.pixel.end());
    }
  }
  return image;
}

render::Image paintShot(Shot& shot, render::ObserverRenderer& renderer, CaptionPainter& painter,
                        int width, int height, bool has_inset) {
  if (shot.light && shot.light->image.rgb.empty()) shot.light->image = shot.packed_light.unpacked();
  const render::ObserverView view = viewFrom(shot.look, width, height);
  render::Image image = renderer.render(shot.solids, shot.light ? &*shot.light : nullptr, view);
  if (has_inset && shot.light) painter.paintInset(image, shot.light->image, "projector image");
  Caption caption = shot.caption;
  caption.has_ghosts = std::any_of(shot.solids.begin(), shot.solids.end(),
                                   [](const auto& solid) { return solid.color.a < 1; });
  return painter.withStrip(image, caption);
}

}  // namespace afterglow::nodes

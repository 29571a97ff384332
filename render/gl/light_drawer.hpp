/// \file
/// A composed frame drawn by OpenGL, four samples a pixel.
#pragma once

#include <memory>

#include "calib/lens.hpp"
#include "render/gl/renderer.hpp"
#include "render/paint/light_frame.hpp"

namespace afterglow::render {

/// Made, used and destroyed with one context current.
class LightDrawer {
 public:
  explicit LightDrawer(const calib::Lens& lens);
  ~LightDrawer();

  /// A frame composed without workers (std::logic_error else), into an image of the lens's size.
  void draw(const LightFrame& frame, Image& image);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::render

/// \file
/// How far a projector's light reaches: depths of the room from the projector's place.
#pragma once

#include <glm/mat4x4.hpp>

#include "calib/lens.hpp"
#include "render/gl/gl_handle.hpp"

namespace afterglow::render {

class ShadowMap {
 public:
  ShadowMap();

  /// Pinhole frustum around all that the lens shows; distortion is left to the look-up of the
  /// light.
  static glm::dmat4 clipFromOptical(const calib::Lens& lens);
  /// Size of a texel at a meter, meters.
  static double texelSize(const calib::Lens& lens);

  /// Empties the map; drawing goes into it from now on.
  void begin();
  const Texture& texture() const { return depth_; }

 private:
  static constexpr int kSize = 768;
  Texture depth_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer framebuffer_ = Framebuffer::make();
};

}  // namespace afterglow::render

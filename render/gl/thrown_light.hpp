/// \file
/// A projector's light as the shaders of a lit room need it: image, lens, depths, and where it is.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "render/gl/gl_handle.hpp"
#include "render/gl/observer_renderer.hpp"

namespace afterglow::render {

/// How far light reaches: depths of the room from the place of a projector or a lamp.
class ShadowMap {
 public:
  static constexpr int kSize = 768;

  explicit ShadowMap(int size = kSize);  ///< texels, each way

  /// Pinhole frustum around all that the lens shows; distortion is left to the look-up of the
  /// light.
  static glm::dmat4 clipFromOptical(const calib::Lens& lens);
  /// Size of a texel at a meter, meters.
  static double texelSize(const calib::Lens& lens);

  /// Empties the map; drawing goes into it from now on.
  void begin();
  const Texture& texture() const { return depth_; }

 private:
  int size_;
  Texture depth_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer framebuffer_ = Framebuffer::make();
};

/// Roughly where a projected image is not black, as the room meets it before the lens: a cheap
/// look-up that spares most of the room the costly one.
class LitMask {
 public:
  static constexpr int kWidth = 128, kHeight = 80;  ///< cells

  explicit LitMask(const calib::Lens& lens);

  /// Cells of ShadowMap::clipFromOptical's square, rows from y = -1 up: 255 where light may be.
  /// The image's size must be the lens's. Valid until the next call.
  const std::vector<std::uint8_t>& mark(const Image& image);
  /// Around what was marked last, of the square from -1 to 1; empty (high < low): nothing.
  const Eigen::AlignedBox2d& marked() const { return marked_; }

 private:
  static constexpr int kBlock = 16;  // px
  struct Cells {
    Eigen::Array2i low, high;  ///< empty where high < low: no ray reaches the block
  };
  bool isLit(const Image& image, int column, int row) const;

  int columns_, rows_;
  std::vector<Cells> cells_of_;  ///< by block of the image
  std::vector<std::uint8_t> mask_;
  Eigen::AlignedBox2d marked_;
};

bool isSameLens(const calib::Lens& a, const calib::Lens& b);

/// Image, lens, depths and pose of a projector.
class ThrownLight {
 public:
  /// Texture units that it takes.
  static constexpr GLint kImageUnit = 0, kShadowUnit = 1, kMaskUnit = 2;

  ThrownLight();

  /// Uploads the image and the projector's pose, and a new lens.
  void set(const ProjectedLight& light);
  /// The depths are the caller's to draw, with clipFromWorld.
  ShadowMap& shadowMap() { return shadow_map_; }
  const glm::dmat4& clipFromWorld() const { return P_shadow_world_; }
  const glm::dvec3& position() const { return p_world_projector_; }
  /// Directions of the corners around the light, in the world; none: it is dark.
  std::optional<std::array<glm::dvec3, 4>> corners() const;
  /// Sets the uniforms of mark_lit.frag and of lit.frag, and binds the textures.
  void use(const Program& mark_program, const Program& lit_program) const;

 private:
  void setLensOf(const ProjectedLight& light);

  ShadowMap shadow_map_;
  Texture image_, mask_ = Texture::make(GL_TEXTURE_2D);
  calib::Lens lens_;
  std::optional<LitMask> lit_mask_;
  double shadow_texel_ = 0;
  glm::dmat4 P_shadow_optical_{1}, P_shadow_world_{1}, T_projector_world_{1};
  glm::dvec3 p_world_projector_{0};
};

}  // namespace afterglow::render

/// \file
/// Images to draw into and to read back.
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>

#include "render/compose/workers.hpp"
#include "render/gl/gl_handle.hpp"
#include "render/scene/image.hpp"

namespace afterglow::render {

/// A projector's image, which the GPU packs into the bytes that Image has, and sends to memory
/// where the CPU reads it in two parts: while it copies the first one the second is on its way.
class RenderTarget {
 public:
  static constexpr int kSamples = 4;  ///< a pixel: what Mesa's llvmpipe has, and every GPU

  /// Throws std::runtime_error if the driver cannot make it.
  RenderTarget(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  const Texture& depths() const { return depth_; }

  /// Clears the target; drawing goes into it from now on, four samples a pixel.
  void begin();
  /// Packs and sends the image, or `painted` instead (8-bit r, g, b, a), once the GPU comes to it:
  /// nobody waits.
  void beginReading(const Buffer* painted);
  /// The image that beginReading() has sent, GL's lowest row first: scenes are drawn upside down,
  /// so that this is the top. Waits for the GPU. `image` has its size.
  void read(Image& image, Workers& workers);

 private:
  static constexpr std::size_t kParts = 2;
  struct SyncDeleter {
    void operator()(GLsync sync) const { glDeleteSync(sync); }
  };
  std::size_t partBegin(std::size_t part) const { return image_bytes_ * part / kParts / 4 * 4; }

  int width_, height_;
  std::size_t image_bytes_;
  Texture color_, depth_;  ///< made when they are first used
  Framebuffer samples_;
  Buffer packed_ = Buffer::make(), sent_ = Buffer::make();
  const char* mapped_ = nullptr;  ///< sent_, as the CPU reads it
  std::unique_ptr<std::remove_pointer_t<GLsync>, SyncDeleter> arrived_[kParts];
  Program pack_program_;
};

/// A picture with one sample a pixel, whose edges are softened when it is read (image.hpp).
/// Its depth, with stencil, may be shared.
class SmoothedTarget {
 public:
  /// Throws std::runtime_error if the driver cannot make it.
  SmoothedTarget(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }

  const Texture& depth() const { return depth_; }
  /// The target's color alone.
  const Framebuffer& color() const { return color_only_; }
  /// Drawing goes into it over what is there, with its depth.
  void beginMore();
  /// GL's lowest row first: pictures are drawn upside down.
  Image read() const;

 private:
  int width_, height_;
  Texture color_ = Texture::make(GL_TEXTURE_2D), depth_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer color_only_ = Framebuffer::make(), drawn_ = Framebuffer::make();
};

/// Throws std::runtime_error if the driver cannot draw into it.
void requireComplete(const Framebuffer& framebuffer, int width, int height);

/// Sets the viewport and clears color (black), depth and stencil of the bound framebuffer.
void clearAll(int width, int height);

/// Sets one filter, and the light beyond the texture's border.
void setSampling(const Texture& texture, GLenum filter, GLenum wrap = GL_CLAMP_TO_EDGE);

/// Runs a program of screen.vert for every pixel, without depth, stencil or blending.
void drawScreen(const Framebuffer& framebuffer, int width, int height, const Program& program,
                const VertexArray& no_vertices);

/// The room before it is lit: how each pixel's surface reflects, faces, and how deep it lies.
class SurfaceTarget {
 public:
  /// Texture units that bind() takes.
  static constexpr GLint kReflectedUnit = 0, kFacingUnit = 1, kDepthUnit = 2;

  /// Shares `depth`, depth and stencil of that size. Throws std::runtime_error if the driver cannot
  /// make it.
  SurfaceTarget(int width, int height, const Texture& depth);

  /// Clears all of it; surfaces (surface.frag and its like) are drawn into it from now on.
  void beginSurfaces();
  /// Binds the target's textures to be read.
  void bind() const;

 private:
  int width_, height_;
  const Texture& depth_;
  Texture reflected_ = Texture::make(GL_TEXTURE_2D), facing_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer surfaces_ = Framebuffer::make();
};

}  // namespace afterglow::render

/// \file
/// Images to draw into and to read back.
#pragma once

#include <glm/vec3.hpp>

#include "render/gl/gl_handle.hpp"
#include "render/scene/image.hpp"

namespace afterglow::render {

/// Four samples a pixel.
class RenderTarget {
 public:
  /// Throws std::runtime_error if the driver cannot make it.
  RenderTarget(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }

  /// Clears the target; drawing goes into it from now on.
  void begin(const glm::vec3& background_rgb);
  /// What is drawn is copied to where the CPU can read it, once the GPU comes to it: nobody waits.
  void beginReading();
  /// The image that beginReading() has copied, GL's lowest row first: scenes are drawn upside down,
  /// so that this is the top. Waits for the GPU. Black where the context is lost.
  void read(Image& image);

 private:
  int width_, height_;
  Framebuffer samples_ = Framebuffer::make(), resolved_ = Framebuffer::make();
  Renderbuffer color_ = Renderbuffer::make(), depth_ = Renderbuffer::make();
  Renderbuffer resolved_color_ = Renderbuffer::make();
  Buffer pixels_ = Buffer::make();  ///< r, g, b, a: what GPUs copy as it is
};

/// The same with one sample a pixel, whose edges are softened when it is read (smooth_edges.hpp).
/// Its depth, with stencil, may be shared.
class SmoothedTarget {
 public:
  /// Throws std::runtime_error if the driver cannot make it.
  SmoothedTarget(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }

  const Texture& depth() const { return depth_; }
  /// Its color alone.
  const Framebuffer& color() const { return color_only_; }
  /// Drawing goes into it over what is there, with its depth.
  void beginMore();
  /// As RenderTarget::read.
  Image read() const;

 private:
  int width_, height_;
  Texture color_ = Texture::make(GL_TEXTURE_2D), depth_ = Texture::make(GL_TEXTURE_2D);
  Framebuffer color_only_ = Framebuffer::make(), drawn_ = Framebuffer::make();
};

/// Throws std::runtime_error if the driver cannot draw into it.
void requireComplete(const Framebuffer& framebuffer, int width, int height);

/// Sets the viewport and clears color, depth and stencil of the bound framebuffer.
void clearAll(int width, int height, const glm::vec3& background_rgb);

/// One filter, and what lies beyond the texture's border.
void setSampling(const Texture& texture, GLenum filter, GLenum wrap = GL_CLAMP_TO_EDGE);

/// Runs a program of screen.vert for every pixel, without depth, stencil or blending.
void drawScreen(const Framebuffer& framebuffer, int width, int height, const Program& program,
                const VertexArray& no_vertices);

/// A framebuffer's pixels, lowest row first.
Image readRgb(const Framebuffer& framebuffer, int width, int height);
void readRgb(const Framebuffer& framebuffer, int width, int height, Image& image);

}  // namespace afterglow::render

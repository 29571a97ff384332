/// \file
/// An OpenGL context without window or screen. Works on any OpenGL 4.5 core, Mesa's llvmpipe
/// included.
#pragma once

#include <memory>
#include <string>

#include "calib/lens.hpp"
#include "render/compose/composed_image.hpp"

namespace afterglow::render {

/// EGL: surfaceless, then device, then default platform. The context is made when it is first used,
/// so that a machine without OpenGL fails no earlier. Objects that draw with it stay in one thread
/// and are destroyed before it. makeCurrent() and description() throw std::runtime_error naming the
/// step that failed and what is missing.
class GlContext {
 public:
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
  /// Makes the context current; called before each use of OpenGL. Several contexts can take turns
  /// in a thread.
  void makeCurrent();
  /// Returns true if the GPU was reset, as far as the driver tells: nothing is drawn from then on.
  bool isLost();
  std::string description();  ///< e.g. "4.5 (Core Profile) Mesa 22.3.6, llvmpipe (...)"

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns true if such a description names a renderer that uses no GPU.
inline bool isSoftware(const std::string& description) {
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "SWR", "Software Rasterizer"}) {
    if (description.find(name) != std::string::npos) return true;
  }
  return false;
}

/// Draws composed images by OpenGL, four samples a pixel. Throws std::runtime_error where OpenGL
/// cannot be used, and why.
std::unique_ptr<ImageDrawer> makeGlDrawer(GlContext& context, const calib::Lens& lens);

}  // namespace afterglow::render

/// \file
/// An OpenGL context without window or screen. Works on any OpenGL 4.5 core, Mesa's llvmpipe
/// included.
#pragma once

#include <memory>
#include <string>

namespace afterglow::render {

/// EGL: surfaceless, then device, then default platform. Made when it is first used: what does
/// without it works where there is none. What draws with it is used in one thread alone and
/// destroyed before it. makeCurrent() and description() throw std::runtime_error naming the step
/// that failed and what is missing.
class GlContext {
 public:
  GlContext();
  ~GlContext();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
  /// Whatever needs the context calls this; several can take turns in a thread.
  void makeCurrent();
  std::string description();  ///< e.g. "4.5 (Core Profile) Mesa 22.3.6, llvmpipe (...)"

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::render

#include "render/gl/gl_context.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <cstdlib>
#include <map>
#include <mutex>
#include <stdexcept>

#include "render/gl/gl_handle.hpp"

namespace afterglow::render {
namespace {

/// eglTerminate ends a display for everyone in the process, so the last context on it does it. The
/// one thing here that outlives a value: EGL's displays are the process's own, too.
class DisplayUsers {
 public:
  static void add(EGLDisplay display) {
    const std::lock_guard<std::mutex> lock(mutex());
    ++counts()[display];
  }
  static void remove(EGLDisplay display) {
    const std::lock_guard<std::mutex> lock(mutex());
    if (--counts()[display] > 0) return;
    counts().erase(display);
    eglTerminate(display);
  }

 private:
  static std::mutex& mutex() {
    static std::mutex instance;
    return instance;
  }
  static std::map<EGLDisplay, int>& counts() {
    static std::map<EGLDisplay, int> instance;
    return instance;
  }
};

std::string eglError() {
  switch (const EGLint code = eglGetError()) {
    case EGL_NOT_INITIALIZED:
      return "EGL_NOT_INITIALIZED";
    case EGL_BAD_MATCH:
      return "EGL_BAD_MATCH";
    case EGL_BAD_ALLOC:
      return "EGL_BAD_ALLOC";
    case EGL_BAD_ATTRIBUTE:
      return "EGL_BAD_ATTRIBUTE";
    default:
      return "EGL error " + std::to_string(code);
  }
}

/// A display and a context on it, current in this thread. Undoes its steps in reverse, also
/// when a step of its making fails.
class EglContext {
 public:
  explicit EglContext(EGLDisplay display) {
    if (display == EGL_NO_DISPLAY) throw std::runtime_error("no such display");
    if (!eglInitialize(display, nullptr, nullptr)) {
      throw std::runtime_error("eglInitialize: " + eglError());
    }
    display_ = display;
    DisplayUsers::add(display_);
    try {
      create();
      checkReadback();
    } catch (...) {
      destroy();
      throw;
    }
  }
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;
  ~EglContext() { destroy(); }

  void makeCurrent() {
    if (eglGetCurrentContext() == context_) return;
    if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
      throw std::runtime_error("eglMakeCurrent: " + eglError());
    }
  }

 private:
  void create() {
    require("EGL_KHR_surfaceless_context");
    if (!eglBindAPI(EGL_OPENGL_API)) throw std::runtime_error("no desktop OpenGL: " + eglError());
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_DONT_CARE, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                             EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!eglChooseConfig(display_, wanted, &config, 1, &count) || count == 0) {
      throw std::runtime_error("no EGL configuration for OpenGL");
    }
    // Told of resets where the driver can; the attributes before are all that is needed.
    EGLint wish[] = {EGL_CONTEXT_MAJOR_VERSION,
                     4,
                     EGL_CONTEXT_MINOR_VERSION,
                     5,
                     EGL_CONTEXT_OPENGL_PROFILE_MASK,
                     EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                     EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                     EGL_LOSE_CONTEXT_ON_RESET,
                     EGL_NONE};
    constexpr std::size_t kOfResets = 6;
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, wish);
    if (context_ == EGL_NO_CONTEXT) {
      wish[kOfResets] = EGL_NONE;
      context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, wish);
    }
    if (context_ == EGL_NO_CONTEXT) {
      throw std::runtime_error("no OpenGL 4.5 core context: " + eglError());
    }
    makeCurrent();
  }

  void require(const char* extension) {
    if (!epoxy_has_egl_extension(display_, extension)) {
      throw std::runtime_error(std::string("no ") + extension);
    }
  }

  /// Some mixes of drivers give a context that draws nothing but black.
  static void checkReadback() {
    const Renderbuffer color = Renderbuffer::make();
    const Framebuffer framebuffer = Framebuffer::make();
    glNamedRenderbufferStorage(color.id(), GL_RGBA8, 4, 4);
    glNamedFramebufferRenderbuffer(framebuffer.id(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                                   color.id());
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.id());
    glClearColor(51 / 255.f, 102 / 255.f, 153 / 255.f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    unsigned char pixel[4] = {};
    glReadPixels(1, 2, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    if (std::abs(pixel[0] - 51) > 1 || std::abs(pixel[1] - 102) > 1 ||
        std::abs(pixel[2] - 153) > 1) {
      throw std::runtime_error("the context does not draw: a cleared image reads back wrong");
    }
  }

  void destroy() {
    if (context_ != EGL_NO_CONTEXT) {
      if (eglGetCurrentContext() == context_) {
        eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
      }
      eglDestroyContext(display_, context_);
    }
    if (display_ != EGL_NO_DISPLAY) DisplayUsers::remove(display_);
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

/// Tries the ways to a context until one works, and keeps the errors of the others.
class Search {
 public:
  void attempt(const std::string& way, EGLDisplay display) {
    if (found_) return;
    try {
      found_ = std::make_unique<EglContext>(display);
    } catch (const std::runtime_error& error) {
      failed(way, error.what());
    }
  }
  void failed(const std::string& way, const std::string& reason) {
    reasons_ += (reasons_.empty() ? "" : "; ") + way + ": " + reason;
  }
  std::unique_ptr<EglContext> result() {
    if (!found_) throw std::runtime_error("no OpenGL context without a window: " + reasons_);
    return std::move(found_);
  }
  bool done() const { return found_ != nullptr; }

 private:
  std::unique_ptr<EglContext> found_;
  std::string reasons_;
};

bool clientHas(const char* extension) { return epoxy_has_egl_extension(EGL_NO_DISPLAY, extension); }

void trySurfaceless(Search& search) {
  if (!clientHas("EGL_EXT_platform_base") || !clientHas("EGL_MESA_platform_surfaceless")) {
    return search.failed("surfaceless", "no EGL_MESA_platform_surfaceless");
  }
  search.attempt("surfaceless", eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA,
                                                         EGL_DEFAULT_DISPLAY, nullptr));
}

void tryDevices(Search& search) {
  if (search.done()) return;
  if (!clientHas("EGL_EXT_platform_device") || !clientHas("EGL_EXT_device_enumeration")) {
    return search.failed("device", "no EGL_EXT_platform_device or EGL_EXT_device_enumeration");
  }
  EGLDeviceEXT devices[16];
  EGLint count = 0;
  if (!eglQueryDevicesEXT(16, devices, &count) || count == 0) {
    return search.failed("device", "none found");
  }
  for (EGLint i = 0; i < count; ++i) {
    search.attempt("device " + std::to_string(i),
                   eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
  }
}

std::unique_ptr<EglContext> findContext() {
  Search search;
  trySurfaceless(search);
  tryDevices(search);
  if (!search.done()) search.attempt("default", eglGetDisplay(EGL_DEFAULT_DISPLAY));
  return search.result();
}

std::string glText(GLenum name) {
  const auto* text = reinterpret_cast<const char*>(glGetString(name));
  return text ? text : "";
}

}  // namespace

struct GlContext::Impl {
  std::unique_ptr<EglContext> egl;
};

GlContext::GlContext() : impl_(std::make_unique<Impl>()) {}
GlContext::~GlContext() = default;

void GlContext::makeCurrent() {
  if (!impl_->egl) impl_->egl = findContext();
  impl_->egl->makeCurrent();
}

bool GlContext::isLost() {
  makeCurrent();
  return glGetGraphicsResetStatus() != GL_NO_ERROR;
}

std::string GlContext::description() {
  makeCurrent();
  return glText(GL_VERSION) + ", " + glText(GL_RENDERER);
}

}  // namespace afterglow::render

// In place of the rest of this room in builds without OpenGL (AFTERGLOW_WITH_GL=OFF): every use of
// OpenGL is refused, and the CPU draws.
#include <stdexcept>

#include "render/gl/gl_context.hpp"
#include "render/gl/observer_renderer.hpp"
#include "render/gl/window.hpp"

namespace afterglow::render {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::runtime_error(what + "this build has no OpenGL: configure with AFTERGLOW_WITH_GL=ON");
}

}  // namespace

struct GlContext::Impl {};
GlContext::GlContext() = default;
GlContext::~GlContext() = default;
void GlContext::makeCurrent() { refuse(""); }
bool GlContext::isLost() { return false; }
std::string GlContext::description() { refuse(""); }

std::unique_ptr<ImageDrawer> makeGlDrawer(GlContext&, const calib::Lens&) { refuse(""); }

struct ObserverRenderer::Impl {};
ObserverRenderer::ObserverRenderer(GlContext&) { refuse("no view of the room: "); }
ObserverRenderer::~ObserverRenderer() = default;
Image ObserverRenderer::render(const std::vector<Drawable>&, const ProjectedLight*,
                               const ObserverView&) {
  refuse("");
}

struct Window::Impl {};
Window::Window(const std::string&, int, int) { refuse("no window: "); }
Window Window::fullScreen(const std::string&, const std::string&, int, int) {
  refuse("no window: ");
}
Window::Window(Window&&) noexcept = default;
Window::~Window() = default;
void Window::show(const Image&) {}
void Window::poll() {}
bool Window::isClosed() const { return true; }
const std::string& Window::problem() const { refuse("no window: "); }
std::vector<Monitor> Window::monitors() { refuse(""); }

}  // namespace afterglow::render

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <stdexcept>

#include "render/gl/light_drawer.hpp"
#include "render/gl/renderer.hpp"
#include "render/paint/frame_painter.hpp"
#include "render/paint/light_frame.hpp"

namespace afterglow::render {
namespace {

/// What the ways of drawing are measured with: a cloud of a depth camera's coarsest image, a
/// meter before the lens.
Scene pointsToMeasure(const calib::Lens& lens) {
  constexpr int kColumns = 160, kRows = 120;
  PointCloud cloud;
  cloud.style = PointStyle::Points;
  cloud.size = 3;
  for (int i = 0; i < kColumns * kRows; ++i) {
    const Eigen::Vector2d share((i % kColumns + 0.5) / kColumns, (i / kColumns + 0.5) / kRows);
    const auto ray =
        calib::unproject(lens, share.cwiseProduct(Eigen::Vector2d(lens.width, lens.height)));
    if (ray) cloud.points.push_back(ray->cast<float>());
  }
  Layer layer;
  layer.drawables = {{{}, std::move(cloud), {}}};
  return {{layer}};
}

}  // namespace

struct ProjectorRenderer::Impl {
  Impl(GlContext& gl_context, const calib::Lens& lens)
      : context(gl_context), width(lens.width), height(lens.height), composer(lens) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { dropDrawer(); }

  void choose(Drawing wanted, const calib::Lens& lens) {
    if (wanted != Drawing::Gl) {
      workers.emplace();
      painter.emplace(lens, *workers);
      description = "drawn by the CPU";
    }
    if (wanted != Drawing::Cpu) {
      try {
        context.makeCurrent();
        drawer.emplace(lens);
        description = "drawn by OpenGL";
      } catch (const std::runtime_error& error) {
        if (wanted == Drawing::Gl) throw;
        description += std::string(" (") + error.what() + ")";
      }
    }
    if (drawer && painter) {
      measure(lens);
    } else if (wanted != Drawing::Measured) {
      description += " (configured)";
    }
    if (drawer) description += "; " + context.description();
    composer.composeForPainter(painter ? &*workers : nullptr);
  }

  /// Keeps whoever is faster.
  void measure(const calib::Lens& lens) {
    const Scene scene = pointsToMeasure(lens);
    composer.composeForPainter(&*workers);
    const double cpu_ms = frameTime(scene);
    composer.composeForPainter(nullptr);
    const double gl_ms = frameTime(scene);
    description = fmt::format("drawn by {} ({:.1f} ms by the CPU, {:.1f} ms by OpenGL)",
                              cpu_ms < gl_ms ? "the CPU" : "OpenGL", cpu_ms, gl_ms);
    if (cpu_ms < gl_ms) {
      dropDrawer();
    } else {
      painter.reset();
      workers.reset();
    }
  }

  /// The best of a few: the first makes buffers and machine code, any may be disturbed. ms
  double frameTime(const Scene& scene) {
    using Clock = std::chrono::steady_clock;
    double best = 1e9;
    Image image;
    for (int i = 0; i < 4; ++i) {
      const Clock::time_point begin = Clock::now();
      render(scene, {}, image);
      best =
          std::min(best, std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    }
    return best;
  }

  void render(const Scene& scene, const Rigid<Projector, World>& T_projector_world, Image& image) {
    const LightFrame& frame = composer.compose(scene, T_projector_world);
    image.width = width;
    image.height = height;
    image.rgb.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    if (composer.isForPainter()) {
      painter->paint(frame, image.rgb.data());
    } else {
      context.makeCurrent();
      drawer->draw(frame, image);
    }
  }

  void dropDrawer() {
    if (drawer) context.makeCurrent();
    drawer.reset();
  }

  GlContext& context;
  int width, height;
  LightComposer composer;
  std::optional<Workers> workers;
  std::optional<FramePainter> painter;
  std::optional<LightDrawer> drawer;
  std::string description;
};

ProjectorRenderer::ProjectorRenderer(GlContext& context, const calib::Lens& lens, Drawing drawing)
    : impl_(std::make_unique<Impl>(context, lens)) {
  impl_->choose(drawing, lens);
}

ProjectorRenderer::~ProjectorRenderer() = default;

Image ProjectorRenderer::render(const Scene& scene,
                                const Rigid<Projector, World>& T_projector_world) {
  Image image;
  impl_->render(scene, T_projector_world, image);
  return image;
}

void ProjectorRenderer::render(const Scene& scene, const Rigid<Projector, World>& T_projector_world,
                               Image& image) {
  impl_->render(scene, T_projector_world, image);
}

const std::string& ProjectorRenderer::description() const { return impl_->description; }

}  // namespace afterglow::render

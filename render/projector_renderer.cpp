#include "render/projector_renderer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <utility>

#include "render/compose/light_composer.hpp"
#include "render/gl/gl_context.hpp"
#include "render/paint/cpu_drawer.hpp"
#include "render/scene/same_scene.hpp"

namespace afterglow::render {
namespace {

/// The scene by which the back ends are measured: a cloud of a depth camera's coarsest image, a
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
  explicit Impl(const calib::Lens& of_projector) : lens(of_projector), composer(lens) {}

  void choose(Drawing wanted, GlContext& context) {
    std::unique_ptr<ImageDrawer> cpu, gl;
    if (wanted != Drawing::Gl) {
      cpu = std::make_unique<CpuDrawer>(lens);
      description = "drawn by the CPU";
    }
    if (wanted != Drawing::Cpu) {
      try {
        gl = makeGlDrawer(context, lens);
        description = "drawn by OpenGL";
      } catch (const std::runtime_error& error) {
        if (wanted == Drawing::Gl) throw;
        description += std::string(" (") + error.what() + ")";
      }
    }
    if (cpu && gl) {
      keepFaster(cpu, gl);
    } else if (wanted != Drawing::Measured) {
      description += " (configured)";
    }
    if (gl) {
      description += "; " + context.description();
      gl_context = &context;
    }
    drawer = std::move(gl ? gl : cpu);
  }

  void keepFaster(std::unique_ptr<ImageDrawer>& cpu, std::unique_ptr<ImageDrawer>& gl) {
    const Scene scene = pointsToMeasure(lens);
    const double cpu_ms = imageTime(*cpu, scene), gl_ms = imageTime(*gl, scene);
    description = fmt::format("drawn by {} ({:.1f} ms by the CPU, {:.1f} ms by OpenGL)",
                              cpu_ms < gl_ms ? "the CPU" : "OpenGL", cpu_ms, gl_ms);
    (cpu_ms < gl_ms ? gl : cpu).reset();
  }

  /// The best of a few: the first makes buffers and machine code, any may be disturbed. The lens
  /// moves on, as otherwise nothing would have to be drawn again. ms
  double imageTime(ImageDrawer& by, const Scene& scene) {
    using Clock = std::chrono::steady_clock;
    double best = 1e9;
    Image image;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    for (int i = 0; i < 4; ++i) {
      T.translation().x() += 1e-3;
      const Clock::time_point begin = Clock::now();
      render(by, scene, Rigid<Projector, World>(T), image);
      best =
          std::min(best, std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    }
    return best;
  }

  void render(ImageDrawer& by, const Scene& scene,
              const Rigid<Projector, World>& T_projector_world, Image& image) {
    by.begin(composer.compose(scene, T_projector_world));
    finish(by, image);
  }

  void finish(ImageDrawer& by, Image& image) const {
    image.width = lens.width;
    image.height = lens.height;
    image.rgb.resize(3 * static_cast<std::size_t>(lens.width) *
                     static_cast<std::size_t>(lens.height));
    by.finish(image);
  }

  /// What shows the same as the last time is not drawn again. A first image is kept only if the
  /// scene before was shown more than once: one that changes all the time pays for no copy.
  void begin(const Scene& scene, const Rigid<Projector, World>& T_projector_world) {
    is_same = is_finished &&
              T_last_projector_world.matrix().matrix() == T_projector_world.matrix().matrix() &&
              isSame(last_scene, scene);
    if (is_same) {
      is_shown_again = true;
      if (!kept.rgb.empty()) return;
    } else {
      is_repeating = std::exchange(is_shown_again, false);
    }
    kept.rgb.clear();
    is_finished = false;
    last_scene = scene;
    T_last_projector_world = T_projector_world;
    drawer->begin(composer.compose(scene, T_projector_world));
  }

  void finish(Image& image) {
    if (is_same && !kept.rgb.empty()) {
      image = kept;
      return;
    }
    finish(*drawer, image);
    if (gl_context != nullptr && gl_context->isLost()) replace(image);
    is_finished = true;
    if (is_same || is_repeating) kept = image;
  }

  /// Once the GPU was reset, by the CPU: light must not go out.
  void replace(Image& image) {
    gl_context = nullptr;
    drawer = std::make_unique<CpuDrawer>(lens);
    description = "drawn by the CPU (OpenGL's context was lost)";
    render(*drawer, last_scene, T_last_projector_world, image);
  }

  calib::Lens lens;
  LightComposer composer;
  std::unique_ptr<ImageDrawer> drawer;
  std::string description;
  GlContext* gl_context = nullptr;  ///< while OpenGL draws
  Scene last_scene;  ///< that was begun
  Rigid<Projector, World> T_last_projector_world;
  bool is_finished = false;     ///< the image of the last scene
  bool is_same = false;         ///< it is to be the image of the scene before
  bool is_shown_again = false;  ///< the last scene, after its first image
  bool is_repeating = false;    ///< the scene before it was
  Image kept;  ///< of the last scene, if that is shown again or likely will be
};

ProjectorRenderer::ProjectorRenderer(GlContext& context, const calib::Lens& lens, Drawing drawing)
    : impl_(std::make_unique<Impl>(lens)) {
  impl_->choose(drawing, context);
}

ProjectorRenderer::~ProjectorRenderer() = default;

Image ProjectorRenderer::render(const Scene& scene,
                                const Rigid<Projector, World>& T_projector_world) {
  Image image;
  render(scene, T_projector_world, image);
  return image;
}

void ProjectorRenderer::render(const Scene& scene, const Rigid<Projector, World>& T_projector_world,
                               Image& image) {
  begin(scene, T_projector_world);
  finish(image);
}

void ProjectorRenderer::begin(const Scene& scene,
                              const Rigid<Projector, World>& T_projector_world) {
  impl_->begin(scene, T_projector_world);
}

void ProjectorRenderer::finish(Image& image) { impl_->finish(image); }

const std::string& ProjectorRenderer::description() const { return impl_->description; }

}  // namespace afterglow::render

#include "render/projector_renderer.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <utility>
#include <variant>

#include "render/compose/light_composer.hpp"
#include "render/gl/gl_context.hpp"
#include "render/paint/cpu_drawer.hpp"
#include "render/scene/scene.hpp"
#include "render/scene/tessellate.hpp"

namespace afterglow::render {
namespace {

/// The scene by which the back ends are measured: a depth camera's image, so many columns wide, a
/// meter before the lens, in colors that tell neighbors apart.
Scene pointsToMeasure(const calib::Lens& lens, int columns) {
  const int rows = columns * 3 / 4;
  PointList points;
  ByteColorList colors;
  std::uint32_t noise = 1;
  for (int i = 0; i < columns * rows; ++i) {
    const Eigen::Vector2d share((i % columns + 0.5) / columns, (i / columns + 0.5) / rows);
    // Bent little by the lens, if at all: where points land is not what is measured.
    const Eigen::Vector2d pixel = share.cwiseProduct(Eigen::Vector2d(lens.width, lens.height));
    const Eigen::Vector3d ray = lens.K.inverse() * pixel.homogeneous();
    noise = 1664525 * noise + 1013904223;
    points.push_back((ray * (1 + 1e-10 * noise)).cast<float>());
    colors.push_back({std::uint8_t(noise >> 24), std::uint8_t(noise >> 16), 200, 255});
  }
  PointCloud cloud;
  cloud.points = std::move(points);
  cloud.colors = std::move(colors);
  cloud.style = PointStyle::Points;
  cloud.size = 3;
  Layer layer;
  layer.drawables = {{{}, std::move(cloud), {}}};
  return {{layer}};
}

}  // namespace

double DrawingPace::msOf(std::size_t points) const {
  constexpr double kSpan = static_cast<double>(kMany) - static_cast<double>(kFew);
  const double share = (static_cast<double>(points) - static_cast<double>(kFew)) / kSpan;
  return std::max(few_ms + share * (many_ms - few_ms), 0.0);
}

bool DrawingChoice::isForGl(std::size_t points, bool was_gl) const {
  constexpr double kClear = 0.8;  // of the other's time
  const double cpu_ms = cpu.msOf(points), gl_ms = gl.msOf(points);
  return was_gl ? !(cpu_ms < kClear * gl_ms) : gl_ms < kClear * cpu_ms;
}

std::string DrawingChoice::text() const {
  const bool few = gl.few_ms < cpu.few_ms, many = gl.many_ms < cpu.many_ms;
  const std::string who = few == many ? few ? "OpenGL" : "the CPU"
                          : many      ? "OpenGL where there is much to draw, else by the CPU"
                                      : "the CPU where there is much to draw, else by OpenGL";
  return fmt::format(
      "drawn by {} ({} points: {:.1f} ms by the CPU, {:.1f} ms by OpenGL; {}: {:.1f} and {:.1f})",
      who, DrawingPace::kFew, cpu.few_ms, gl.few_ms, DrawingPace::kMany, cpu.many_ms, gl.many_ms);
}

std::size_t pointsOf(const Scene& scene) {
  std::size_t points = 0;
  for (const Layer& layer : scene.layers) {
    for (const Drawable& drawable : layer.drawables) points += cornersOf(drawable.shape);
  }
  return points;
}

struct ProjectorRenderer::Impl {
  explicit Impl(const calib::Lens& of_projector) : lens(of_projector), composer(lens) {}

  void choose(Drawing wanted, GlContext& context) {
    if (wanted != Drawing::Gl) {
      cpu = std::make_unique<CpuDrawer>(lens);
      description = "drawn by the CPU";
    }
    if (wanted != Drawing::Cpu) {
      try {
        // Software's takes a hundred times as long as the CPU: that needs no measuring.
        if (wanted == Drawing::Measured && isSoftware(context.description())) {
          throw std::runtime_error("OpenGL is software: " + context.description());
        }
        gl = makeGlDrawer(context, lens);
        description = "drawn by OpenGL";
      } catch (const std::runtime_error& error) {
        if (wanted == Drawing::Gl) throw;
        description += std::string(" (") + error.what() + ")";
      }
    }
    if (cpu && gl) {
      measure();
    } else if (wanted != Drawing::Measured) {
      description += " (configured)";
    }
    if (gl) {
      description += "; " + context.description();
      gl_context = &context;
    }
    drawer = gl ? gl.get() : cpu.get();
  }

  void measure() {
    const Scene few = pointsToMeasure(lens, DrawingPace::kFewColumns);
    const Scene many = pointsToMeasure(lens, DrawingPace::kManyColumns);
    choice.cpu = {imageTime(*cpu, few), imageTime(*cpu, many)};
    choice.gl = {imageTime(*gl, few), imageTime(*gl, many)};
    description = choice.text();
  }

  /// The best of a few: the first makes buffers and machine code, any may be disturbed. Each is of
  /// a cloud that has just come. ms
  double imageTime(ImageDrawer& by, Scene scene) {
    using Clock = std::chrono::steady_clock;
    double best = 1e9;
    Image image;
    auto& cloud = std::get<PointCloud>(scene.layers[0].drawables[0].shape);
    for (int i = 0; i < 4; ++i) {
      cloud.points = PointList(cloud.points.get());
      cloud.colors = ByteColorList(cloud.colors.get());
      const Clock::time_point begin = Clock::now();
      render(by, scene, {}, image);
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

  /// Begins an image; a scene that shows the same as the last time is not drawn again. A first
  /// image is kept only if the scene before was shown more than once: one that changes all the time
  /// pays for no copy.
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
    if (cpu && gl) {
      drawer = choice.isForGl(pointsOf(scene), drawer == gl.get()) ? gl.get() : cpu.get();
    }
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
    gl.reset();
    if (!cpu) cpu = std::make_unique<CpuDrawer>(lens);
    drawer = cpu.get();
    description = "drawn by the CPU (OpenGL's context was lost)";
    render(*drawer, last_scene, T_last_projector_world, image);
  }

  calib::Lens lens;
  LightComposer composer;
  std::unique_ptr<ImageDrawer> cpu, gl;
  ImageDrawer* drawer = nullptr;  ///< the drawer of the last image, of the two
  DrawingChoice choice;           ///< choice, where there are two
  std::string description;
  GlContext* gl_context = nullptr;  ///< while OpenGL draws
  Scene last_scene;                 ///< scene that was begun last
  Rigid<Projector, World> T_last_projector_world;
  bool is_finished = false;     ///< the image of the last scene
  bool is_same = false;         ///< true: it is to be the image of the scene before
  bool is_shown_again = false;  ///< the last scene, after its first image
  bool is_repeating = false;    ///< the scene before it was
  Image kept;  ///< image of the last scene, if that is shown again or likely will be
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

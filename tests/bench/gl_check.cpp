// The OpenGL back end on a machine of which nothing else is known: whether it draws what the CPU
// draws, and how long both take from a message's bytes to the image in memory. Needs no ROS, no PCL
// and no source tree. Runs in under two minutes.
//   gl_check [options of GoogleTest]
//   gl_check --only TEXT       no tests, and times of what has this in its name
#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "render/compose/workers.hpp"
#include "render/gl/observer_renderer.hpp"
#include "render/projector_renderer.hpp"
#include "render/scene/typeface.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render {
namespace {

using Clock = std::chrono::steady_clock;

double msSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

struct Size {
  int width, height;
};
constexpr Size kSizes[] = {{1280, 800}, {1920, 1080}, {3840, 2160}};

calib::Lens lensOf(const Size& size) {
  return test::lens(size.width, size.height, 0.9 * size.width, 0.5 * size.width, 0.6 * size.height,
                    {-0.2, 0.05, 0.001, -0.001, 0});
}

// -------------------------------------------------------------------------------- a cloud's bytes

constexpr std::size_t kStep = 32, kColorAt = 16;

/// The data of a depth camera's PointCloud2: x, y, z, rgb, 32 bytes a point.
std::vector<std::uint8_t> cloudBytes(std::size_t count) {
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 0.002f);
  const auto columns = static_cast<std::size_t>(std::sqrt(static_cast<double>(count) * 4 / 3));
  std::vector<std::uint8_t> bytes(count * kStep);
  for (std::size_t i = 0; i < count; ++i) {
    const auto wide = static_cast<float>(columns), high = static_cast<float>(count) / wide;
    const float across = static_cast<float>(i % columns) / wide - 0.5f;
    const float down = static_cast<float>(i / columns) / high - 0.5f;
    const float z = 1.5f + 0.1f * std::sin(20 * across) * std::cos(15 * down) + noise(random);
    const float p[] = {1.1f * across * z, 0.7f * down * z, z};
    const std::uint32_t rgb = random() & 0xffffff;
    std::memcpy(&bytes[kStep * i], p, sizeof(p));
    std::memcpy(&bytes[kStep * i + kColorAt], &rgb, sizeof(rgb));
  }
  return bytes;
}

/// As projector_node reads such bytes: by all processors, if they are many. Each time something
/// differs: what does not would not be drawn.
PointCloud cloudOf(const std::vector<std::uint8_t>& bytes, PointStyle style, float size,
                   bool has_colors, Workers& workers, unsigned time = 0) {
  const std::size_t count = bytes.size() / kStep;
  PointList points(count);
  ByteColorList colors(has_colors ? count : 0);
  workers.share(count, [&](int, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::memcpy(points[i].data(), &bytes[kStep * i], 3 * sizeof(float));
      if (!has_colors) continue;
      std::uint32_t rgb;
      std::memcpy(&rgb, &bytes[kStep * i + kColorAt], sizeof(rgb));
      colors[i] = {static_cast<std::uint8_t>(rgb >> 16), static_cast<std::uint8_t>(rgb >> 8),
                   static_cast<std::uint8_t>(rgb), 255};
    }
  });
  points[0].x() += 1e-6f * static_cast<float>(time);
  PointCloud cloud;
  cloud.points = std::move(points);
  cloud.colors = std::move(colors);
  cloud.style = style;
  cloud.size = size;
  return cloud;
}

// -------------------------------------------------------------------------------------------
// markers
/// Of all types, in the places of a raster; `seed` says what is where.
std::vector<Drawable> markers(int count, unsigned seed) {
  static const auto letters = std::make_shared<const Body>(Typeface().block(U"box 7", 0.03));
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<Drawable> all;
  for (int i = 0; i < count; ++i) {
    const PointList points = {{-0.02f, 0, 0}, {0.02f, 0.01f, 0}, {0.01f, -0.02f * unit(random), 0}};
    const Eigen::Vector3f size(0.04f, 0.03f, 0.02f);
    PointCloud squares;
    squares.points = points;
    squares.style = PointStyle::Squares;
    const std::vector<Shape> shapes = {Arrow{0.04f, 0.01f, 0.02f, 0.01f},
                                       Cube{size},
                                       Sphere{size},
                                       Cylinder{size},
                                       Lines{points, {}, 0.005f, true},
                                       ShapeList{ShapeList::Kind::Cubes, points, {}, 0.3f * size},
                                       ShapeList{ShapeList::Kind::Spheres, points, {}, 0.3f * size},
                                       Triangles{points, {}},
                                       squares,
                                       Text{letters}};
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() << 0.03 * (i % 50) - 0.75, 0.024 * (i / 50) - 0.48,
        1.5 + 0.1 * double(unit(random));
    T.rotate(Eigen::AngleAxisd(3.0 * double(unit(random)), Eigen::Vector3d(1, 2, 3).normalized()));
    all.push_back({Rigid<World, World>(T),
                   shapes[static_cast<std::size_t>(i) % shapes.size()],
                   {unit(random), 1, unit(random), 1}});
  }
  return all;
}

// ---------------------------------------------------------------------------------------------
// times
/// How long the GPU works on what it is asked for between begin() and end().
class GpuTimer {
 public:
  explicit GpuTimer(GlContext& context) : context_(context) {
    context_.makeCurrent();
    glGenQueries(1, &query_);
  }
  ~GpuTimer() {
    context_.makeCurrent();
    glDeleteQueries(1, &query_);
  }
  GpuTimer(const GpuTimer&) = delete;
  GpuTimer& operator=(const GpuTimer&) = delete;

  void begin() const {
    context_.makeCurrent();
    glBeginQuery(GL_TIME_ELAPSED, query_);
  }
  void end() const { glEndQuery(GL_TIME_ELAPSED); }
  double ms() const {
    GLuint64 ns = 0;
    glGetQueryObjectui64v(query_, GL_QUERY_RESULT, &ns);
    return 1e-6 * static_cast<double>(ns);
  }

 private:
  GlContext& context_;
  GLuint query_ = 0;
};

/// Times of one stage after the other, and their sum; the GPU's own.
struct Times {
  std::vector<double> made, begun, finished, all, gpu;
  bool is_lit = false;
};

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

/// Scenes are made, begun and finished for a second, or so often; of the first ones nothing counts.
Times timesOf(ProjectorRenderer& renderer, const std::function<Scene(unsigned)>& make,
              const GpuTimer* gpu) {
  constexpr unsigned kFirst = 3, kMost = 200;
  constexpr double kEnough = 800;  // ms
  Times times;
  Image image;
  const Clock::time_point start = Clock::now();
  for (unsigned i = 0; i < kMost + kFirst; ++i) {
    if (!times.all.empty() && msSince(start) > kEnough) break;
    const Clock::time_point begin = Clock::now();
    const Scene scene = make(i);
    const double made = msSince(begin);
    if (gpu != nullptr) gpu->begin();
    renderer.begin(scene, {});
    if (gpu != nullptr) gpu->end();
    const double begun = msSince(begin);
    renderer.finish(image);
    const double all = msSince(begin);
    if (i < kFirst && all < kEnough) continue;
    times.made.push_back(made);
    times.begun.push_back(begun - made);
    times.finished.push_back(all - begun);
    times.all.push_back(all);
    times.gpu.push_back(gpu != nullptr ? gpu->ms() : 0);
  }
  times.is_lit =
      std::any_of(image.rgb.begin(), image.rgb.end(), [](auto value) { return value > 0; });
  return times;
}

struct Row {
  std::string name;
  std::function<Scene(unsigned)> make;
};

Scene sceneOf(std::vector<Drawable> drawables, float alpha = 1) {
  for (Drawable& drawable : drawables) drawable.color.a *= alpha;
  Layer layer;
  layer.drawables = std::move(drawables);
  return {{layer}};
}

std::vector<Row> rows(Workers& workers) {
  std::vector<Row> all = {{"nothing", [](unsigned i) {
                             Layer layer;
                             layer.name = std::to_string(i);  // what stays is not drawn again
                             layer.drawables = {{{}, PointCloud{}, {}}};
                             layer.drawables[0].color.r = static_cast<float>(i);
                             return Scene{{layer}};
                           }}};
  for (const std::size_t count : {19'200, 307'200, 1'000'000}) {
    const auto bytes = std::make_shared<std::vector<std::uint8_t>>(cloudBytes(count));
    const auto cloud = [bytes, &workers](PointStyle style, float size, bool has_colors) {
      return [=, &workers](unsigned i) {
        return sceneOf({{{}, cloudOf(*bytes, style, size, has_colors, workers, i), {}}});
      };
    };
    const std::string number = std::to_string(count);
    all.push_back({number + " points of 3 px", cloud(PointStyle::Points, 3, true)});
    if (count != 307'200) continue;
    all.push_back({number + " points, one color", cloud(PointStyle::Points, 3, false)});
    const auto kept =
        std::make_shared<PointCloud>(cloudOf(*bytes, PointStyle::Points, 3, true, workers));
    all.push_back({number + " points that stay, moved", [=](unsigned i) {
                     Scene scene = sceneOf({{{}, *kept, {}}});
                     Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
                     T.translation().x() = 1e-4 * (i % 10 + 1);
                     scene.layers[0].drawables[0].pose = Rigid<World, World>(T);
                     return scene;
                   }});
    all.push_back({number + " squares of 4 mm", cloud(PointStyle::Squares, 0.004f, true)});
    all.push_back({number + " boxes of 4 mm", cloud(PointStyle::Boxes, 0.004f, true)});
    all.push_back({number + " balls of 4 mm", cloud(PointStyle::Spheres, 0.004f, true)});
  }
  all.push_back({"2,000 markers anew", [](unsigned i) { return sceneOf(markers(2000, i)); }});
  const auto stay = std::make_shared<std::vector<Drawable>>(markers(2000, 1));
  all.push_back({"2,000 markers, one moves", [=](unsigned i) {
                   std::vector<Drawable> some = *stay;
                   some[1].color.r = 0.01f * static_cast<float>(i % 100);
                   return sceneOf(std::move(some));
                 }});
  return all;
}

void printProjector(GlContext& context, const std::string& only) {
  std::printf("\n%-32s %9s | %23s | %39s\n", "", "", "CPU", "OpenGL");
  std::printf("%-32s %9s | %7s %7s %7s | %7s %7s %7s %7s %7s\n", "ms from bytes or values to image",
              "scene", "draw", "all", "p99", "begin", "finish", "(GPU)", "all", "p99");
  const GpuTimer gpu(context);
  Workers workers;
  for (const Size& size : kSizes) {
    ProjectorRenderer cpu(context, lensOf(size), Drawing::Cpu);
    ProjectorRenderer gl(context, lensOf(size), Drawing::Gl);
    std::printf("%dx%d\n", size.width, size.height);
    for (const Row& row : rows(workers)) {
      const bool is_usual =
          row.name == "nothing" || row.name.find("points of 3 px") != std::string::npos;
      if (size.width != kSizes[0].width && !is_usual) continue;
      if (row.name.find(only) == std::string::npos) continue;
      const Times by_cpu = timesOf(cpu, row.make, nullptr), by_gl = timesOf(gl, row.make, &gpu);
      std::printf("%-32s %9.2f | %7.2f %7.2f %7.2f | %7.2f %7.2f %7.2f %7.2f %7.2f%s\n",
                  row.name.c_str(), quantile(by_gl.made, 0.5),
                  quantile(by_cpu.begun, 0.5) + quantile(by_cpu.finished, 0.5),
                  quantile(by_cpu.all, 0.5), quantile(by_cpu.all, 0.99), quantile(by_gl.begun, 0.5),
                  quantile(by_gl.finished, 0.5), quantile(by_gl.gpu, 0.5), quantile(by_gl.all, 0.5),
                  quantile(by_gl.all, 0.99), by_cpu.is_lit && by_gl.is_lit ? "" : "  dark");
      std::fflush(stdout);
    }
    const ProjectorRenderer chosen(context, lensOf(size), Drawing::Measured);
    std::printf("auto: %s\n", chosen.description().c_str());
  }
}

/// A bystander's view of a room of 60 things.
void printObserver(GlContext& context) {
  std::vector<Drawable> room;
  const auto put = [&](double x, double y, double z, Shape shape) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() << x, y, z;
    room.push_back({Rigid<World, World>(T), std::move(shape), {0.5f, 0.4f, 0.3f, 1}});
  };
  put(1, 0, -0.05, Cube{{7, 7, 0.1f}});
  for (int i = 0; i < 59; ++i)
    put(0.5 + 0.3 * (i % 8), 0.3 * (i / 8) - 1, 0.1, Cube{{0.1f, 0.1f, 0.2f}});
  const calib::Lens lens = lensOf(kSizes[0]);
  const auto T_projector_world = test::lookAt<Projector>({0.2, 0, 1.6}, {1.5, 0, 0}).inverse();
  Scene scene = sceneOf({});
  for (int i = 0; i < 20; ++i) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() << 0.8 + 0.07 * i, 0.1 * (i % 5), 0.02;
    scene.layers[0].drawables.push_back(
        {Rigid<World, World>(T), Arrow{0.09f, 0.04f, 0.08f, 0.04f}, {}});
  }
  const ProjectedLight light{
      lens, T_projector_world,
      ProjectorRenderer(context, lens, Drawing::Cpu).render(scene, T_projector_world)};
  ObserverRenderer renderer(context);
  ObserverView view;
  std::vector<double> times;
  for (int i = 0; i < 20; ++i) {
    view.T_world_observer = test::lookAt<Observer>({-1.2 + 0.01 * i, -2.6, 1.9}, {1.4, 0.1, 0.3});
    const Clock::time_point begin = Clock::now();
    renderer.render(room, &light, view);
    times.push_back(msSince(begin));
  }
  std::printf("a bystander's view of a lit room, %dx%d: %.2f ms\n", view.width, view.height,
              quantile(times, 0.5));
}

}  // namespace
}  // namespace afterglow::render

int main(int argc, char** argv) {
  const bool is_time_only = argc == 3 && std::string(argv[1]) == "--only";
  const std::string only = is_time_only ? argv[2] : "";
  testing::InitGoogleTest(&argc, argv);
  try {
    afterglow::render::GlContext context;
    std::printf("%s\n", context.description().c_str());
    const int failed = is_time_only ? 0 : RUN_ALL_TESTS();
    afterglow::render::printProjector(context, only);
    afterglow::render::printObserver(context);
    return failed;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gl_check: %s\n", error.what());
    return 1;
  }
}

// Frames of the projector and of the bystander's view.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <memory>

#include "render/gl/observer_renderer.hpp"
#include "render/light_blend.hpp"
#include "render/light_output.hpp"
#include "render/paint/dark_mask.hpp"
#include "render/projector_renderer.hpp"
#include "render/scene/relief.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render {
namespace {

Rigid<World, World> at(double x, double y, double z) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << x, y, z;
  return Rigid<World, World>(T);
}

const Rigid<World, Projector> kProjector = test::lookAt<Projector>({0.2, 0, 1.6}, {1.5, 0, 0});

/// A micrometer to and fro: what does not change would not be drawn.
Rigid<Projector, World> moved(const Rigid<Projector, World>& pose) {
  static bool is_moved = false;
  Eigen::Isometry3d T = pose.matrix();
  if ((is_moved = !is_moved)) T.translation().x() += 1e-6;
  return Rigid<Projector, World>(T);
}

PointCloud cloud(int side, PointStyle style, float size) {
  PointCloud cloud;
  cloud.style = style;
  cloud.size = size;
  for (int i = 0; i < side * side; ++i) {
    cloud.points.emplace_back(1.0f + 0.8f * static_cast<float>(i / side) / static_cast<float>(side),
                              0.4f * static_cast<float>(i % side) / static_cast<float>(side), 0.7f);
  }
  return cloud;
}

/// The paper's pictures: a cloud on the table, a path on a bounded floor, an obstacle.
Scene scene(int side) {
  Scene scene;
  Layer points;
  points.drawables = {{{}, cloud(side, PointStyle::Boxes, 0.005f), {0, 1, 0, 1}}};
  Layer path;
  path.placement = Placement::Drape;
  path.surface = SurfacePatch{"floor", {}, {{-2, -2}, {4, -2}, {4, 2}, {-2, 2}}};
  for (int i = 0; i < 20; ++i) {
    path.drawables.push_back({at(0.8 + 0.1 * i, -0.3, 0.1), Arrow{0.09f, 0.04f, 0.08f, 0.04f}, {}});
  }
  Layer obstacle;
  obstacle.drawables = {{at(1.8, 0.6, 0.2), Sphere{Eigen::Vector3f::Constant(0.45f)}, {}}};
  scene.layers = {points, path, obstacle};
  return scene;
}

const std::vector<double> kBent = {-0.2, 0.05, 0.001, -0.001, 0};

void projectorFrame(benchmark::State& state, const std::vector<double>& D) {
  GlContext context;
  ProjectorRenderer renderer(context, test::lens(1280, 800, 1100, 640, 500, D));
  const Scene content = scene(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    benchmark::DoNotOptimize(renderer.render(content, moved(kProjector.inverse())));
  }
}

void projectorStraight(benchmark::State& state) { projectorFrame(state, {}); }
void projectorDistorted(benchmark::State& state) { projectorFrame(state, kBent); }
// 0: nothing to draw but path and obstacle; 32 * 32 = 1024 boxes; 100 * 100.
BENCHMARK(projectorStraight)
    ->Arg(0)
    ->Arg(32)
    ->Arg(100)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(projectorDistorted)->Arg(32)->Arg(100)->Unit(benchmark::kMillisecond)->UseRealTime();

void projectorPoints(benchmark::State& state) {
  GlContext context;
  ProjectorRenderer renderer(context, test::lens(1280, 800, 1100, 640, 500, kBent));
  Layer layer;
  layer.drawables = {{{}, cloud(static_cast<int>(state.range(0)), PointStyle::Points, 3), {}}};
  for (auto _ : state) {
    benchmark::DoNotOptimize(renderer.render({{layer}}, moved(kProjector.inverse())));
  }
}
BENCHMARK(projectorPoints)->Arg(100)->Arg(554)->Unit(benchmark::kMillisecond)->UseRealTime();

/// 0.6 m x 0.6 m in cells of 1 cm: a bump, a step, and a depth camera's unevenness of half a
/// millimeter.
std::shared_ptr<const Relief> tableRelief() {
  constexpr int kNodes = 61;
  std::vector<float> heights;
  std::uint32_t noise = 1;
  for (int i = 0; i < kNodes * kNodes; ++i) {
    const double x = 0.01 * (i % kNodes) - 0.3, y = 0.01 * (i / kNodes) - 0.3;
    const double r = std::hypot(x + 0.1, y) / 0.15;
    noise = 1664525 * noise + 1013904223;
    const double uneven = 0.0005 * (static_cast<double>(noise >> 8) / (1 << 23) - 1);
    heights.push_back(static_cast<float>((r < 1 ? 0.03 * (1 + std::cos(r * M_PI)) : 0) +
                                         (x > 0.15 ? 0.05 : 0) + uneven));
  }
  return std::make_shared<Relief>(Eigen::Vector2d(-0.3, -0.3), 0.01, kNodes, kNodes, heights);
}

/// A box's footprint, a path and a row of arrows that move over a relief; draped or for a viewer.
void reliefUnderMovingContent(benchmark::State& state) {
  GlContext context;
  ProjectorRenderer renderer(context, test::lens(1280, 800, 1100, 640, 500, kBent));
  Layer layer;
  layer.placement = state.range(0) == 0 ? Placement::Drape : Placement::Viewer;
  layer.surface =
      SurfacePatch{"table", Rigid<World, Surface>(at(1.5, 0, 0.7).matrix()), {}, tableRelief()};
  layer.p_viewer = {2.5, -0.8, 1.8};
  Lines path;
  path.width = 0.03f;
  for (int i = 0; i <= 20; ++i) {
    path.points.emplace_back(-0.28f + 0.028f * static_cast<float>(i),
                             0.2f + 0.05f * std::sin(0.5f * static_cast<float>(i)), 0.12f);
  }
  int frame = 0;
  for (auto _ : state) {
    const double shift = 0.001 * (frame++ % 50);
    std::vector<Drawable> content = {{at(1.45 + shift, -0.05, 0.9), Cube{{0.3f, 0.2f, 0.1f}}, {}},
                                     {at(1.5, shift, 0.7), path, {0, 1, 0, 1}}};
    for (int i = 0; i < 5; ++i) {
      content.push_back(
          {at(1.25 + 0.1 * i + shift, -0.25, 0.85), Arrow{0.09f, 0.02f, 0.05f, 0.03f}, {}});
    }
    layer.drawables = content;
    benchmark::DoNotOptimize(renderer.render({{layer}, {*layer.surface}}, kProjector.inverse()));
  }
}
BENCHMARK(reliefUnderMovingContent)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->UseRealTime();

/// 0: nothing lit, 1: a usual picture, 2: every pixel another color.
Image picture(int kind) {
  Image drawn{1280, 800, std::vector<std::uint8_t>(3ul * 1280 * 800)};
  for (std::size_t i = 0; i < drawn.rgb.size() && kind > 0; ++i) {
    if (kind == 2) drawn.rgb[i] = static_cast<std::uint8_t>(i * i >> 7);
    if (kind == 1 && i / 3 % 1280 < 128) drawn.rgb[i] = i % 3 == 1 ? 255 : 20;
  }
  return drawn;
}

/// What color.yaml costs beside drawing.
void lightColors(benchmark::State& state) {
  std::vector<std::uint8_t> table(3ul * 33 * 33 * 33, 100);
  const LightOutput output({{}, 1, Mirror::None, table});
  const Image drawn = picture(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    Image image = drawn;
    output.apply(image);
    benchmark::DoNotOptimize(image);
  }
}
BENCHMARK(lightColors)->DenseRange(0, 2)->Unit(benchmark::kMillisecond)->UseRealTime();

/// A depth camera's cloud of the floor, of a table, and of things that stand on them, half of it.
PointList standingCloud() {
  PointList points;
  for (int i = 0; i < 640 * 480; ++i) {
    const float x = 0.5f + 2.f * static_cast<float>(i / 640) / 480;
    const float y = -1 + 2.f * static_cast<float>(i % 640) / 640;
    points.emplace_back(x, y, i % 2 == 0 ? 0.3f + 0.1f * std::sin(9 * x) : x > 1.5f ? 0.7f : 0.f);
  }
  return points;
}

/// What of 307,200 new points stands over two surfaces.
void findStanding(benchmark::State& state) {
  const PointList cloud = standingCloud();
  const std::vector<SurfacePatch> surfaces = {
      {"floor", {}, {{-4, -4}, {4, -4}, {4, 4}, {-4, 4}}},
      {"table",
       Rigid<World, Surface>(at(2, 0, 0.7).matrix()),
       {{-0.5, -0.9}, {0.5, -0.9}, {0.5, 0.9}, {-0.5, 0.9}}}};
  for (auto _ : state) benchmark::DoNotOptimize(standingPoints(cloud, {}, surfaces, 0.1));
}
BENCHMARK(findStanding)->Unit(benchmark::kMillisecond)->UseRealTime();

/// What an image costs beside its drawing that keeps light off so many points: none, half a cloud,
/// a whole one.
void keepDark(benchmark::State& state) {
  DarkMask mask(test::lens(1280, 800, 1100, 640, 500, kBent));
  PointList points = standingCloud();
  points.resize(static_cast<std::size_t>(state.range(0)));
  const std::vector<AvoidedPoints> avoided = {{{}, points, 0.1f}};
  Image image{1280, 800, std::vector<std::uint8_t>(3ul * 1280 * 800, 255)};
  for (auto _ : state) {
    mask.draw(avoided, moved(kProjector.inverse()));
    mask.apply(image);
    benchmark::DoNotOptimize(image);
  }
}
BENCHMARK(keepDark)
    ->Arg(0)
    ->Arg(153'600)
    ->Arg(307'200)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// Two projectors over floor and table.
struct Overlap {
  std::vector<SurfacePatch> surfaces = {{"floor", {}, {}},
                                        {"table",
                                         Rigid<World, Surface>(at(1.5, 0, 0.7).matrix()),
                                         {{-0.4, -0.3}, {0.4, -0.3}, {0.4, 0.3}, {-0.4, 0.3}}}};
  LightBlend blend{{{test::lens(1280, 800, 1100, 640, 500, kBent), 2000, 1, 0.001},
                    {test::lens(1280, 800, 1100, 640, 500, kBent), 1500, 1, 0.001}},
                   false};

  void share() {
    const auto other = test::lookAt<Projector>({2.8, 0.4, 1.9}, {1.6, 0, 0}).inverse();
    blend.update(surfaces, {moved(kProjector.inverse()), other});
  }
};

/// The shares of both, where one of them has moved.
void lightShares(benchmark::State& state) {
  Overlap overlap;
  for (auto _ : state) overlap.share();
  state.counters["shared"] = overlap.blend.summary(0).shared;
}
BENCHMARK(lightShares)->Unit(benchmark::kMillisecond)->UseRealTime();

/// A projector's image by its shares.
void lightShared(benchmark::State& state) {
  Overlap overlap;
  overlap.share();
  const LightOutput output({{}, 1, Mirror::None, {}}, true);
  const Image drawn = picture(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    Image image = drawn;
    output.apply(image, &overlap.blend.light(0));
    benchmark::DoNotOptimize(image);
  }
}
BENCHMARK(lightShared)->DenseRange(0, 2)->Unit(benchmark::kMillisecond)->UseRealTime();

/// What a floor's texture costs beside drawing: nothing lit, a tenth of the picture, a third of it
/// in ever other colors, all of it in one, all of it in ever other colors. The projector moves all
/// the time, or stands still while a hundredth of the picture changes.
void lightTextures(benchmark::State& state, bool is_moving) {
  calib::SurfaceTexture texture;
  texture.surface = "floor";
  texture.color.levels = {0, 255};
  texture.color.response.fill({0, 1});
  texture.cell = 0.0025;
  texture.columns = texture.rows = 1200;
  texture.origin = {0, -1.5};
  texture.density = 0.5;
  for (int i = 0; i < texture.columns * texture.rows; ++i) {
    const float albedo = 0.3f + 0.01f * static_cast<float>(i % 49);
    Eigen::Matrix3f M = albedo * Eigen::Matrix3f::Identity();
    M(0, 1) = M(1, 0) = M(1, 2) = 0.03f;
    texture.cells.push_back({M, Eigen::Vector3f::Constant(0.01f)});
  }
  const calib::Lens lens = test::lens(1280, 800, 1100, 640, 500, kBent);
  LightSettings settings;
  settings.textures = {texture};
  LightOutput output(settings, lens);
  const std::vector<SurfacePatch> surfaces = {
      {"floor", {}, {{-10, -10}, {10, -10}, {10, 10}, {-10, 10}}}};
  Image drawn{1280, 800, std::vector<std::uint8_t>(3ul * 1280 * 800)};
  for (std::size_t i = 0; i < drawn.rgb.size() && state.range(0) > 0; ++i) {
    const std::size_t column = i / 3 % 1280;
    const bool is_noise = state.range(0) == 2 || state.range(0) == 4;
    const bool is_lit = column < (state.range(0) == 1 ? 128 : state.range(0) == 2 ? 427 : 1280);
    if (is_lit)
      drawn.rgb[i] = is_noise ? static_cast<std::uint8_t>(i * i >> 7) : i % 3 == 1 ? 255 : 20;
  }
  Image image;
  for (auto _ : state) {
    state.PauseTiming();
    for (std::size_t i = 0; i < drawn.rgb.size() / 100; ++i)
      drawn.rgb[i] ^= drawn.rgb[i] > 1 ? 1 : 0;
    image = drawn;
    state.ResumeTiming();
    output.apply(image, surfaces, is_moving ? moved(kProjector.inverse()) : kProjector.inverse());
    benchmark::DoNotOptimize(image);
  }
}
BENCHMARK_CAPTURE(lightTextures, moving, true)
    ->DenseRange(0, 4)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(lightTextures, still, false)
    ->DenseRange(0, 4)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void observerFrame(benchmark::State& state) {
  GlContext context;
  const calib::Lens lens = test::lens(1280, 800, 1100, 640, 500, kBent);
  ProjectorRenderer projector(context, lens);
  const ProjectedLight light{lens, kProjector.inverse(),
                             projector.render(scene(32), kProjector.inverse())};
  std::vector<Drawable> room = {{at(1, 0, -0.05), Cube{{7, 7, 0.1f}}, {}},
                                {at(4.5, 0, 1.3), Cube{{0.1f, 7, 2.6f}}, {}}};
  for (int i = 0; i < 58; ++i) {
    const auto pose = at(0.5 + 0.3 * (i % 8), -1 + 0.3 * (i / 8), 0.1);
    if (i % 2 == 0) {
      room.push_back({pose, Cube{{0.1f, 0.1f, 0.2f}}, {0.5f, 0.3f, 0.2f, 1}});
    } else {
      room.push_back({pose, Cylinder{{0.1f, 0.1f, 0.2f}}, {0.2f, 0.3f, 0.5f, 1}});
    }
  }
  ObserverRenderer renderer(context);
  ObserverView view;
  view.width = 960;
  view.height = 540;
  view.T_world_observer = test::lookAt<Observer>({-1.2, -2.6, 1.9}, {1.4, 0.1, 0.3});
  for (auto _ : state) {
    benchmark::DoNotOptimize(renderer.render(room, state.range(0) ? &light : nullptr, view));
  }
}
BENCHMARK(observerFrame)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace afterglow::render

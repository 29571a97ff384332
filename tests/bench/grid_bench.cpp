// Maps and images: what a message takes to become shapes, and what those take to be drawn while the
// projector moves.
#include <benchmark/benchmark.h>
#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "nodes/conversion/grid_conversion.hpp"
#include "render/projector_renderer.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render {
namespace {

constexpr int kSide = 4000;

/// A building of 200 m: walls and doors, unknown around, and specks; `inflated`: a costmap of it.
nav_msgs::OccupancyGrid building(bool inflated) {
  nav_msgs::OccupancyGrid map;
  map.info.width = map.info.height = kSide;
  map.info.resolution = 0.05f;
  map.info.origin.position.x = map.info.origin.position.y = -100;
  map.info.origin.orientation.w = 1;
  map.data.reserve(std::size_t{kSide} * kSide);
  std::uint32_t random = 1;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      random = random * 1664525u + 1013904223u;
      const int to_wall = std::min(std::abs(x % 160 - 80), std::abs(y % 200 - 100));
      const bool is_door = (x + y) % 400 < 30;
      const bool is_unknown = std::hypot(x - 2000, y - 2000) > 1900;
      const bool is_wall = (to_wall < 2 && !is_door) || random >> 22 == 0;
      const int cost = inflated && to_wall < 20 ? 95 - 4 * to_wall : 0;
      map.data.push_back(static_cast<std::int8_t>(is_unknown ? -1 : is_wall ? 100 : cost));
    }
  }
  return map;
}

sensor_msgs::Image photograph() {
  sensor_msgs::Image image;
  image.width = 640;
  image.height = 480;
  image.step = 3 * 640;
  image.encoding = sensor_msgs::image_encodings::RGB8;
  std::uint32_t random = 1;
  for (int i = 0; i < 640 * 480 * 3; ++i) {
    random = random * 1664525u + 1013904223u;
    image.data.push_back(static_cast<std::uint8_t>(i / 3 % 640 / 4 + (random >> 28)));
  }
  return image;
}

template <typename Convert>
void conversion(benchmark::State& state, const Convert& convert) {
  std::size_t rectangles = 0;
  for (auto _ : state) {
    const auto drawn = convert();
    rectangles = std::get<MeshInstance>(drawn.value->at(0).shape).body->triangles.size() / 2;
  }
  state.counters["rectangles"] = static_cast<double>(rectangles);
}

void drawing(benchmark::State& state, nodes::Drawables drawables, Drawing drawing) {
  GlContext context;
  ProjectorRenderer renderer(context, test::lens(1280, 800, 1150, 640, 480, {-0.1, 0.02, 0, 0, 0}),
                             drawing);
  Layer layer;
  layer.placement = Placement::Drape;
  layer.surface = SurfacePatch{"floor", {}, {}};
  layer.drawables = std::move(drawables);
  Image image;
  double x = 0;
  for (auto _ : state) {
    x += 1e-5;
    const auto T = test::lookAt<Projector>({0.2 + x, 0, 1.6}, {1.5 + x, 0, 0});
    renderer.render({{layer}, {}}, T.inverse(), image);
  }
  if (!isLit(image)) state.SkipWithError("the picture is black");
}

const bool kRegistered = [] {
  const auto report = [](const std::string& name, const auto& convert) {
    benchmark::RegisterBenchmark((name + "_converted").c_str(),
                                 [convert](benchmark::State& state) { conversion(state, convert); })
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
    for (const auto& [suffix, how] :
         {std::pair("_moving_cpu", Drawing::Cpu), {"_moving_opengl", Drawing::Gl}}) {
      benchmark::RegisterBenchmark(
          (name + suffix).c_str(),
          [convert, how = how](benchmark::State& state) { drawing(state, *convert().value, how); })
          ->Unit(benchmark::kMillisecond)
          ->UseRealTime();
    }
  };
  using nodes::ColorScheme;
  report("map_4000x4000", [] {
    static const auto map = building(false);
    return nodes::toMapShapes(map, ColorScheme::Map);
  });
  report("costmap_4000x4000", [] {
    static const auto map = building(true);
    return nodes::toMapShapes(map, ColorScheme::Costmap);
  });
  report("image_640x480", [] {
    static const auto image = photograph();
    nodes::ImagePlane plane;
    plane.width = 2;
    plane.center = {1.5, 0, 0};
    return nodes::toImageShapes(image, plane);
  });
  return true;
}();

}  // namespace
}  // namespace afterglow::render

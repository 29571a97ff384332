// What counts as the same scene, which is not drawn again.
#include "render/scene/scene.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <memory>

#include "render/scene/relief.hpp"

namespace afterglow::render::same_scene_test {
namespace {

Scene makeScene() {
  Layer layer;
  layer.name = "/things";
  layer.placement = Placement::Drape;
  layer.surface = SurfacePatch{"floor", {}, {{0, 0}, {1, 0}, {1, 1}}};
  layer.reader = Reader{};
  PointCloud cloud;
  cloud.points = {Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(4, 5, 6)};
  cloud.colors = {Rgba{}, Rgba{255, 0, 0, 255}};
  Lines lines;
  lines.points = {{0, 0, 0}, {1, 1, 1}};
  layer.drawables = {{{}, Arrow{}, {}},     {{}, Cube{}, {}},      {{}, Sphere{}, {}},
                     {{}, Cylinder{}, {}},  {{}, lines, {}},       {{}, ShapeList{}, {}},
                     {{}, Triangles{}, {}}, {{}, cloud, {}},       {{}, Text{}, {}},
                     {{}, MeshInstance{}, {}}};
  return {{layer}, {*layer.surface}};
}

TEST(SameScene, isOneOfEqualValuesWhetherItSharesListsOrNot) {
  const Scene scene = makeScene();
  EXPECT_TRUE(isSame(scene, scene));
  EXPECT_TRUE(isSame(scene, Scene(scene)));
  EXPECT_TRUE(isSame(scene, makeScene()));
  EXPECT_TRUE(isSame(Scene{}, Scene{}));
}

TEST(SameScene, isNotOneThatDiffersAnywhere) {
  using Change = std::function<void(Scene&)>;
  const auto drawable = [](std::size_t i, const std::function<void(Drawable&)>& change) {
    return [=](Scene& scene) { change(scene.layers[0].drawables[i]); };
  };
  const auto body = std::make_shared<const Body>();
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
  moved.translation().x() = 1e-9;
  const std::vector<Change> changes = {
      [](Scene& scene) { scene.layers.push_back({}); },
      [](Scene& scene) { scene.surfaces.clear(); },
      [](Scene& scene) { scene.surfaces[0].polygon[0].x() = 2; },
      [](Scene& scene) { scene.layers[0].name = "/others"; },
      [](Scene& scene) { scene.layers[0].placement = Placement::Viewer; },
      [](Scene& scene) { scene.layers[0].p_viewer.x() = 1; },
      [](Scene& scene) { scene.layers[0].gain = 0.5f; },
      [](Scene& scene) { scene.layers[0].reader.reset(); },
      [](Scene& scene) { scene.layers[0].reader->is_direction = true; },
      [](Scene& scene) { scene.layers[0].surface.reset(); },
      [&](Scene& scene) {
        scene.layers[0].surface->T_world_surface = Rigid<World, Surface>(moved);
      },
      [](Scene& scene) {
        scene.layers[0].surface->relief = std::make_shared<const Relief>(
            Eigen::Vector2d(0, 0), 0.1, 2, 2, std::vector<float>(4, 0.f));
      },
      [](Scene& scene) { scene.layers[0].drawables.pop_back(); },
      drawable(0, [&](Drawable& d) { d.pose = Rigid<World, World>(moved); }),
      drawable(0, [](Drawable& d) { d.color.a = 0.5f; }),
      drawable(0, [](Drawable& d) { d.shape = Cube{}; }),
      drawable(0, [](Drawable& d) { std::get<Arrow>(d.shape).head_length = 0.1f; }),
      drawable(1, [](Drawable& d) { std::get<Cube>(d.shape).size.z() = 2; }),
      drawable(2, [](Drawable& d) { std::get<Sphere>(d.shape).size.z() = 2; }),
      drawable(3, [](Drawable& d) { std::get<Cylinder>(d.shape).size.z() = 2; }),
      drawable(4, [](Drawable& d) { std::get<Lines>(d.shape).points.edit()[1].z() = 2; }),
      drawable(4, [](Drawable& d) { std::get<Lines>(d.shape).width_px = 2; }),
      drawable(5, [](Drawable& d) { std::get<ShapeList>(d.shape).colors.push_back({}); }),
      drawable(6, [](Drawable& d) { std::get<Triangles>(d.shape).points.edit().resize(3); }),
      drawable(7, [](Drawable& d) { std::get<PointCloud>(d.shape).points.edit()[1].z() = 7; }),
      drawable(7, [](Drawable& d) { std::get<PointCloud>(d.shape).colors.edit()[1].a = 0; }),
      drawable(7, [](Drawable& d) { std::get<PointCloud>(d.shape).size_y = 1; }),
      drawable(8, [&](Drawable& d) { std::get<Text>(d.shape).letters = body; }),
      drawable(9, [&](Drawable& d) { std::get<MeshInstance>(d.shape).body = body; }),
      drawable(9, [](Drawable& d) { std::get<MeshInstance>(d.shape).own_colors = true; })};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Scene changed = makeScene();
    changes[i](changed);
    EXPECT_FALSE(isSame(makeScene(), changed)) << "change " << i;
    EXPECT_TRUE(isSame(changed, Scene(changed))) << "change " << i;
  }
}

TEST(SameScene, mayHavePointsThatAreNotNumbers) {
  Scene scene = makeScene();
  std::get<PointCloud>(scene.layers[0].drawables[7].shape).points.edit()[0].x() =
      std::numeric_limits<float>::quiet_NaN();
  Scene other = scene;
  std::get<PointCloud>(other.layers[0].drawables[7].shape).points.edit();  // no longer shared
  EXPECT_TRUE(isSame(scene, other));
}

}  // namespace
}  // namespace afterglow::render::same_scene_test

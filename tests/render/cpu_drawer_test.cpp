// Scenes drawn by the CPU: what a step becomes, whatever the machine.
#include "render/paint/cpu_drawer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "render/compose/light_composer.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::cpu_drawer_test {
namespace {

const calib::Lens kLens = test::lens(320, 200, 300, 160, 120, {-0.2, 0.05, 0.001, -0.001, 0});

Image drawn(const Scene& scene, int threads) {
  LightComposer composer(kLens);
  Image image{kLens.width, kLens.height, {}};
  image.rgb.resize(std::size_t{3} * 320 * 200);
  CpuDrawer(kLens, threads).draw(composer.compose(scene, {}), image);
  return image;
}

/// More points than one thread draws alone, each of a color of its own.
PointCloud wall(PointStyle style, float size) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> wide(-0.9f, 0.9f), deep(1.2f, 1.6f), color(0, 1);
  PointCloud cloud;
  cloud.style = style;
  cloud.size = size;
  for (int i = 0; i < 9000; ++i) {
    cloud.points.emplace_back(wide(random), 0.7f * wide(random), deep(random));
    cloud.colors.push_back(asBytes(Color{color(random), color(random), color(random), 1}));
  }
  return cloud;
}

Scene sceneOf(const PointCloud& cloud, float alpha = 1) {
  Layer layer;
  layer.drawables = {{{}, cloud, {1, 1, 1, alpha}}};
  return {{layer}};
}

TEST(CpuDrawer, drawsTheSameImageWithAnyNumberOfThreads) {
  Scene scene = sceneOf(wall(PointStyle::Points, 3), 0.6f);
  scene.layers.push_back(sceneOf(wall(PointStyle::Boxes, 0.01f)).layers[0]);
  scene.layers.push_back(sceneOf(wall(PointStyle::Squares, 0.02f), 0.5f).layers[0]);
  scene.layers[0].drawables.push_back({{}, Sphere{Eigen::Vector3f::Constant(0.9f)}, {}});
  const Image one = drawn(scene, 1);
  EXPECT_GT(test::litPixels(one), 10'000);
  for (const int threads : {2, 3, 8}) EXPECT_EQ(drawn(scene, threads).rgb, one.rgb) << threads;
}

TEST(CpuDrawer, drawsTheRestOfAListThatBeginsWithWhatIsNotFinite) {
  for (const PointStyle style : {PointStyle::Points, PointStyle::Squares, PointStyle::Boxes,
                                 PointStyle::Spheres}) {
    PointCloud cloud;
    cloud.style = style;
    cloud.size = style == PointStyle::Points ? 5 : 0.05f;
    cloud.points = {{std::nanf(""), 0, 1}, {0, 0, 1}};
    EXPECT_GT(test::litPixels(drawn(sceneOf(cloud), 1)), 20) << static_cast<int>(style);
  }
}

/// Of any shape but a mesh, of a color that may be translucent, somewhere before the lens.
Drawable randomDrawable(std::mt19937& random, const SharedBody& letters) {
  std::uniform_real_distribution<float> unit(0, 1);
  const auto between = [&](float low, float high) { return low + (high - low) * unit(random); };
  const Eigen::Vector3f size(between(0.02f, 0.3f), 0.1f, between(0.02f, 0.2f));
  PointCloud squares;
  squares.style = PointStyle::Squares;
  squares.size = 0.02f;
  PointList few;
  for (int i = 0; i < 30; ++i) {
    few.emplace_back(between(-0.2f, 0.2f), between(-0.2f, 0.2f), between(-0.1f, 0.1f));
  }
  squares.points = few;
  PointCloud pixels = squares;
  pixels.style = PointStyle::Points;
  pixels.size = 3;
  Lines lines;
  lines.points = few;
  lines.colors = ColorList(few.size(), Color{1, between(0, 1), 0, 1});
  ShapeList list;
  list.points = few;
  list.size = Eigen::Vector3f::Constant(0.03f);
  list.kind = unit(random) < 0.5f ? ShapeList::Kind::Cubes : ShapeList::Kind::Spheres;
  const std::vector<Shape> shapes = {Arrow{}, Cube{size}, Sphere{size}, Cylinder{size}, lines,
                                     list, Triangles{few, {}}, Text{letters}, squares,
                                     pixels};
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.rotate(Eigen::AngleAxisd(double(between(0, 3)), Eigen::Vector3d(1, 2, 3).normalized()));
  T.translation() = Eigen::Vector3f(between(-0.6f, 0.6f), between(-0.4f, 0.4f), between(1.1f, 1.9f))
                        .cast<double>();
  return {Rigid<World, World>(T), shapes[random() % shapes.size()],
          {between(0, 1), between(0, 1), between(0, 1), unit(random) < 0.7f ? 1 : 0.5f}};
}

/// Changes something, or nothing.
void change(std::mt19937& random, const SharedBody& letters, Scene& scene, Eigen::Isometry3d& T) {
  auto& drawables = scene.layers[random() % scene.layers.size()].drawables;
  Drawable& one = drawables[random() % drawables.size()];
  switch (random() % 12) {
    case 0:
      drawables.insert(drawables.begin(), randomDrawable(random, letters));
      break;
    case 1:
      if (drawables.size() > 3) drawables.pop_back();
      break;
    case 2:
      std::swap(one, drawables.back());
      break;
    case 3:
      T.translation().x() += 0.01;
      break;
    case 4:
      scene.surfaces[0].polygon[0].x() -= 0.05;
      break;
    case 5:
      scene.layers[1].gain *= 0.9f;
      break;
    case 6:
      one.color.a = one.color.a == 1 ? 0.6f : 1;
      break;
    case 7:
      scene.layers.push_back(scene.layers[0]);
      break;
    case 8:
      if (scene.layers.size() > 2) scene.layers.pop_back();
      break;
    case 9:
      break;
    default:
      one = randomDrawable(random, letters);
  }
}

TEST(CpuDrawer, drawsAnImageAfterOthersAsIfItWereTheFirst) {
  Body letter;
  letter.points = {{0, 0, 0}, {0.2f, 0, 0}, {0, 0.3f, 0}};
  letter.triangles = {{0, 1, 2}};
  letter.outline = {{0, 1}, {1, 2}, {2, 0}};
  const auto letters = std::make_shared<const Body>(letter);
  std::mt19937 random(11);
  Eigen::Isometry3d T_world_board = Eigen::Isometry3d::Identity();
  T_world_board.translation().z() = 1.5;
  const SurfacePatch board{
      "board", Rigid<World, Surface>(T_world_board), {{-0.5, -0.4}, {0.5, -0.4}, {0, 0.4}}};
  T_world_board.translation() = Eigen::Vector3d(0.2, 0.1, 1.3);
  const SurfacePatch before{
      "before", Rigid<World, Surface>(T_world_board), {{0, 0}, {0.1, 0}, {0.1, 0.2}}};
  Scene scene{{Layer{}, Layer{}}, {before, board}};
  scene.layers[1].placement = Placement::Drape;
  scene.layers[1].surface = board;
  for (Layer& layer : scene.layers) {
    for (int i = 0; i < 30; ++i) {
      layer.drawables.push_back(randomDrawable(random, letters));
    }
  }
  LightComposer composer(kLens);
  CpuDrawer drawer(kLens, 3);
  Image image{kLens.width, kLens.height, {}};
  Eigen::Isometry3d T_projector_world = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 100; ++i) {
    const ComposedImage& composed =
        composer.compose(scene, Rigid<Projector, World>(T_projector_world));
    image.rgb.assign(std::size_t{3} * 320 * 200, 99);
    drawer.draw(composed, image);
    Image first{kLens.width, kLens.height, {}};
    first.rgb.resize(image.rgb.size());
    CpuDrawer(kLens, 1).draw(composed, first);
    ASSERT_EQ(image.rgb, first.rgb) << "image " << i;
    change(random, letters, scene, T_projector_world);
  }
  EXPECT_GT(test::litPixels(image), 1000);
}

}  // namespace
}  // namespace afterglow::render::cpu_drawer_test

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
#include "tests/support/changing_scene.hpp"
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

TEST(CpuDrawer, drawsAnImageAfterOthersAsIfItWereTheFirst) {
  test::ChangingScene changing;
  LightComposer composer(kLens);
  CpuDrawer drawer(kLens, 3);
  Image image{kLens.width, kLens.height, {}};
  for (int i = 0; i < 100; ++i) {
    const ComposedImage& composed = composer.compose(changing.scene, changing.T_projector_world());
    image.rgb.assign(std::size_t{3} * 320 * 200, 99);
    drawer.draw(composed, image);
    Image first{kLens.width, kLens.height, {}};
    first.rgb.resize(image.rgb.size());
    CpuDrawer(kLens, 1).draw(composed, first);
    ASSERT_EQ(image.rgb, first.rgb) << "image " << i;
    changing.change();
  }
  EXPECT_GT(test::litPixels(image), 1000);
}

}  // namespace
}  // namespace afterglow::render::cpu_drawer_test

// Which steps a scene's drawing has, in which order, and where their light may fall.
#include "render/compose/light_composer.hpp"

#include <gtest/gtest.h>

#include "tests/support/optics.hpp"

namespace afterglow::render::light_composer_test {
namespace {

/// Before the lens, facing it.
SurfacePatch surfaceAt(const std::string& name, double z, double half) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0, -0.3 * z, z;
  T.linear() = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()).toRotationMatrix();
  return {name, Rigid<World, Surface>(T),
          {{-half, -half}, {half, -half}, {half, half}, {-half, half}}};
}

Layer layerOn(const SurfacePatch& surface) {
  Layer layer;
  layer.placement = Placement::Drape;
  layer.surface = surface;
  layer.drawables = {{{}, Cube{}, {}}, {{}, Sphere{}, {}}};
  return layer;
}

class LightComposerTest : public ::testing::Test {
 protected:
  LightComposer composer_{test::viewsonic()};
};

TEST_F(LightComposerTest, keepsLayersAndDrawablesInTheirOrder) {
  Layer direct;
  direct.drawables = {{{}, Arrow{}, {}}};
  const Scene scene{{direct, layerOn(surfaceAt("floor", 2, 0.2))}};
  const ComposedImage& image = composer_.compose(scene, {});
  ASSERT_EQ(image.layers.size(), 2u);
  EXPECT_FALSE(image.layers[0].placed.flattened);
  EXPECT_EQ(image.layers[0].steps, std::vector<const Drawable*>{&scene.layers[0].drawables[0]});
  EXPECT_TRUE(image.layers[1].placed.flattened);
  const auto& drawables = scene.layers[1].drawables;
  EXPECT_EQ(image.layers[1].steps, (std::vector<const Drawable*>{&drawables[0], &drawables[1]}));
}

TEST_F(LightComposerTest, makesOneMaskForAllLayersOfASurface) {
  const SurfacePatch floor = surfaceAt("floor", 2, 0.2), table = surfaceAt("table", 1, 0.02);
  Layer direct;
  const Scene scene{{layerOn(floor), direct, layerOn(floor)}, {floor, table}};
  const ComposedImage& image = composer_.compose(scene, {});
  EXPECT_EQ(image.layers[0].mask, 0);
  EXPECT_EQ(image.layers[1].mask, -1);
  EXPECT_EQ(image.layers[2].mask, 0);
  ASSERT_EQ(image.masks.size(), 1u);
  ASSERT_TRUE(image.masks[0].outline);
  EXPECT_EQ(image.masks[0].outline->size(), 4u);
  EXPECT_EQ(image.masks[0].shades.size(), 1u) << "the table's";
  EXPECT_EQ(composer_.compose({{layerOn(table)}, {floor, table}}, {}).masks[0].shades.size(), 0u);
}

TEST_F(LightComposerTest, needsNoMaskForAnEndlessSurfaceWithNothingBeforeIt) {
  SurfacePatch wall = surfaceAt("wall", 2, 1);
  wall.polygon.clear();
  const ComposedImage& image = composer_.compose({{layerOn(wall)}}, {});
  EXPECT_EQ(image.layers[0].mask, -1);
  EXPECT_TRUE(image.masks.empty());
}

TEST_F(LightComposerTest, laysPixelSizedPointsOnAReliefAndLeavesTheirCloudAsItWas) {
  SurfacePatch table = surfaceAt("table", 2, 0.5);
  table.relief = std::make_shared<Relief>(Eigen::Vector2d(-0.5, -0.5), 0.1, 11, 11,
                                          std::vector<float>(121, 0.05f));
  PointCloud cloud;
  cloud.style = PointStyle::Points;
  cloud.points = {{0, -0.6f, 1.5f}, {9, 0, 1.5f}};
  Layer layer = layerOn(table);
  layer.drawables = {{{}, cloud, {}}};
  const Scene scene{{layer}};
  const ComposedImage& image = composer_.compose(scene, {});
  ASSERT_NE(image.layers[0].relief, nullptr);
  const PointCloud& laid = *pixelCloud(image.layers[0].steps.at(0)->shape);
  ASSERT_EQ(laid.points.size(), 1u) << "the other one falls beside the table";
  EXPECT_NEAR(laid.points[0].z(), 1.95, 1e-6);
  EXPECT_EQ(pixelCloud(scene.layers[0].drawables[0].shape)->points, cloud.points);
}

TEST_F(LightComposerTest, keepsWhatItKnowsOfAReliefAsLongAsAllLandsAtTheSamePlaces) {
  SurfacePatch table = surfaceAt("table", 2, 0.5);
  table.relief = std::make_shared<Relief>(Eigen::Vector2d(-0.5, -0.5), 0.1, 11, 11,
                                          std::vector<float>(121, 0.05f));
  const Scene scene{{layerOn(table), layerOn(table)}};
  const auto first = composer_.compose(scene, {}).layers[0].relief;
  EXPECT_EQ(composer_.compose(scene, {}).layers[1].relief, first);
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
  moved.translation().x() = 0.1;
  EXPECT_NE(composer_.compose(scene, Rigid<Projector, World>(moved)).layers[0].relief, first);
}

}  // namespace
}  // namespace afterglow::render::light_composer_test

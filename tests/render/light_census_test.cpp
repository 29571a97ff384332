// What is counted of a scene: how much of it the light reaches, and what keeps it from the rest.
#include "render/compose/light_census.hpp"

#include <gtest/gtest.h>

#include "tests/support/optics.hpp"

namespace afterglow::render::light_census_test {
namespace {

/// Its middle is the middle of the image; the light is 0.8 m wide at 1 m.
const calib::Lens kLens = test::lens(160, 120, 200, 80, 60);

Drawable at(double x, double z, Shape shape, Color color = {}) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << x, 0, z;
  return {Rigid<World, World>(T), std::move(shape), color};
}

Cube smallCube() { return {Eigen::Vector3f::Constant(0.05f)}; }

LayerCensus countOf(std::vector<Drawable> drawables, std::optional<SurfacePatch> surface = {}) {
  Layer layer;
  layer.name = "/layer";
  layer.drawables = std::move(drawables);
  if (surface) layer.placement = Placement::Drape;
  layer.surface = std::move(surface);
  return LightCensus(kLens).count({{layer}}, {}).at(0);
}

PointCloud cloudOf(std::size_t points, PointStyle style) {
  PointCloud cloud;
  cloud.style = style;
  for (std::size_t i = 0; i < points; ++i) cloud.points.push_back({0, 0, 0});
  return cloud;
}

/// A meter before the lens, facing it, around (x, 0).
SurfacePatch surfaceAt(double x, double half) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << x, 0, 1;
  T.linear() = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()).toRotationMatrix();
  return {"floor", Rigid<World, Surface>(T),
          {{-half, -half}, {half, -half}, {half, half}, {-half, half}}};
}

TEST(LightCensus, tellsWhatIsLitBesideTheLightAndBehindTheLens) {
  const LayerCensus census = countOf({at(0, 1, smallCube()), at(0.38, 1, smallCube()),
                                      at(2, 1, smallCube()), at(0, -1, smallCube())});
  EXPECT_EQ(census.name, "/layer");
  EXPECT_EQ(census.drawables, 4u);
  EXPECT_EQ(census.lit, 2u);
  EXPECT_EQ(census.outside, 1u);
  EXPECT_EQ(census.behind, 1u);
}

TEST(LightCensus, takesWhatIsLargerThanTheLightForLit) {
  EXPECT_EQ(countOf({at(0, 1, Cube{Eigen::Vector3f(50, 50, 0.01f)})}).lit, 1u);
}

TEST(LightCensus, tellsWhatHasNoLightOfItsOwnAndWhatHasNoPoints) {
  const LayerCensus census =
      countOf({at(0, 1, smallCube(), {0, 0, 0, 1}), at(0, 1, smallCube(), {1, 1, 1, 0}),
               at(0, 1, cloudOf(5, PointStyle::Points), {0, 0, 0, 1}),
               at(0, 1, cloudOf(0, PointStyle::Points)), at(0, 1, Lines{})});
  EXPECT_EQ(census.black, 3u);
  EXPECT_EQ(census.empty, 2u);
}

TEST(LightCensus, looksAtCloudsOfAnySizeAndStyle) {
  for (const std::size_t points : {3u, 5000u}) {
    for (const PointStyle style : {PointStyle::Points, PointStyle::Boxes}) {
      const LayerCensus census =
          countOf({at(0, 1, cloudOf(points, style)), at(2, 1, cloudOf(points, style)),
                   at(0, -1, cloudOf(points, style))});
      EXPECT_EQ(census.lit, 1u) << points;
      EXPECT_EQ(census.outside, 1u) << points;
      EXPECT_EQ(census.behind, 1u) << points;
    }
  }
}

TEST(LightCensus, tellsWhatLiesBesideTheSurface) {
  const SurfacePatch floor = surfaceAt(0, 0.1);
  const LayerCensus census =
      countOf({at(0, 1, smallCube()), at(0.3, 1, smallCube()),
               at(0.3, 1, cloudOf(5000, PointStyle::Points)), at(2, 1, smallCube()),
               at(0, 1, Cube{Eigen::Vector3f(50, 50, 0.01f)})},
              floor);
  EXPECT_EQ(census.lit, 2u);
  EXPECT_EQ(census.clipped, 2u);
  EXPECT_EQ(census.outside, 1u);
}

TEST(LightCensus, tellsWhatAnotherSurfaceShades) {
  Layer layer;
  layer.placement = Placement::Drape;
  layer.surface = surfaceAt(0, 0.3);
  layer.drawables = {at(0, 1, smallCube())};
  SurfacePatch table = surfaceAt(0, 0.1);
  table.name = "table";
  Eigen::Isometry3d T = table.T_world_surface.matrix();
  T.translation().z() = 0.5;
  table.T_world_surface = Rigid<World, Surface>(T);
  const auto census = LightCensus(kLens).count({{layer}, {*layer.surface, table}}, {});
  EXPECT_EQ(census.at(0).clipped, 1u);
}

}  // namespace
}  // namespace afterglow::render::light_census_test

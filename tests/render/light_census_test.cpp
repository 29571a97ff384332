// What is counted of a scene: how much of it the light reaches, and what keeps it from the rest.
#include "render/compose/light_census.hpp"

#include <gtest/gtest.h>

#include "render/scene/tessellate.hpp"
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
  EXPECT_EQ(census.black, 2u);
  EXPECT_EQ(census.transparent, 1u);
  EXPECT_EQ(census.empty, 2u);
}

TEST(LightCensus, takesWhatNoPixelShowsForFlat) {
  const auto flat = [](float x, float y, float z) { return Cube{Eigen::Vector3f(x, y, z)}; };
  Lines strip;
  strip.points = PointList(3, Eigen::Vector3f(0.01f, 0, 0));
  Triangles needle;
  needle.points = PointList{{0, 0, 0}, {0.1f, 0, 0}, {0.05f, 0, 0}};
  PointCloud dust = cloudOf(3, PointStyle::Squares);
  dust.size = 1e-6f;
  PointCloud far_dust = cloudOf(5000, PointStyle::Boxes);
  far_dust.size = 1e-9f;
  const LayerCensus census = countOf({at(0, 1, flat(1e-9f, 0.1f, 0.1f)), at(0, 1, strip),
                                      at(0, 1, needle), at(0, 1, dust), at(0, 1, far_dust)});
  EXPECT_EQ(census.flat, 5u);
  EXPECT_EQ(census.lit, 0u);
  EXPECT_EQ(countOf({at(0, 1, flat(0.1f, 0.1f, 1e-9f))}).lit, 1u) << "flat, but seen from above";
}

TEST(LightCensus, countsManySmallThingsInOnePixelTogether) {
  ShapeList grains;
  grains.points = PointList(2000, Eigen::Vector3f::Zero());
  grains.size = Eigen::Vector3f::Constant(1e-4f);  // 0.02 px
  EXPECT_EQ(countOf({at(0, 1, grains)}).lit, 1u);
  grains.points = PointList(2, Eigen::Vector3f::Zero());
  EXPECT_EQ(countOf({at(0, 1, grains)}).flat, 1u);
}

TEST(LightCensus, tellsOfListsOfMoreLargeThingsThanAreDrawn) {
  ShapeList balls;
  balls.kind = ShapeList::Kind::Spheres;
  balls.points = PointList(80'000, Eigen::Vector3f::Zero());
  balls.size = Eigen::Vector3f::Constant(0.2f);  // 40 px
  LayerCensus census = countOf({at(0, 1, balls)});
  EXPECT_EQ(census.thinned, 1u);
  EXPECT_EQ(census.lit, 1u);
  balls.size = Eigen::Vector3f::Constant(0.02f);
  EXPECT_EQ(countOf({at(0, 1, balls)}).thinned, 0u) << "small ones are all drawn";
}

/// Memory grows with the corners: 80,000 spheres of 192 sides had 31 million.
TEST(Tessellate, boundsTheCornersOfAListAndStillShowsAllOfAShorterOne) {
  Eye eye;
  eye.focal_px = 2000;
  Tessellation out;
  ShapeList balls;
  balls.kind = ShapeList::Kind::Spheres;
  for (const std::size_t count : {20'000u, 80'000u, 200'000u}) {
    balls.points = PointList(count, Eigen::Vector3f(0, 0, 3));
    tessellate(at(0, 0, balls), eye, out);
    EXPECT_LE(out.mesh.points.size(), kMostCorners) << count;
    EXPECT_GE(out.mesh.points.size(), kMostCorners / 3) << count;
  }
  balls.points = PointList(1000, Eigen::Vector3f(0, 0, 3));
  tessellate(at(0, 0, balls), eye, out);
  EXPECT_EQ(out.convex_parts.size(), 1000u);
  PointCloud squares = cloudOf(1 << 20, PointStyle::Squares);
  tessellate(at(0, 0, squares), eye, out);
  EXPECT_LE(out.mesh.points.size(), kMostCorners);
}

TEST(LightCensus, takesTextWithoutLettersForBlank) {
  EXPECT_EQ(countOf({at(0, 1, Text{std::make_shared<const Body>()})}).blank, 1u);
}

TEST(LightCensus, takesLightThatRoundsToNothingForBlack) {
  const LayerCensus census = countOf({at(0, 1, smallCube(), {0.001f, 0.001f, 0.001f, 1}),
                                      at(0, 1, smallCube(), {1, 1, 1, 0.003f})});
  EXPECT_EQ(census.black, 1u);
  EXPECT_EQ(census.lit, 1u);
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

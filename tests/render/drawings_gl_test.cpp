// What the CPU draws and what OpenGL draws is the same image.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "render/scene/typeface.hpp"
#include "tests/support/changing_scene.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::drawings_gl_test {
namespace {

const std::vector<double> kBent = {-0.2, 0.05, 0.001, -0.001, 0};
const std::vector<double> kFolding = {-0.35, 0, 0, 0, 0};

/// A bumpy wall of points about 1.5 m away, wider than the image, in colors that tell neighbors
/// apart.
PointCloud wall(int count, float size_px, bool colored) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> wide(-0.9f, 0.9f), deep(1.3f, 1.9f), color(0, 1);
  PointCloud cloud;
  cloud.style = PointStyle::Points;
  cloud.size = size_px;
  ColorList colors;
  PointList points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(wide(random), 0.7f * wide(random), deep(random));
    if (colored) colors.push_back({color(random), color(random), color(random), 1});
  }
  cloud.points = std::move(points);
  cloud.colors = asBytes(colors);
  return cloud;
}

Layer layerOf(PointCloud cloud, const Color& color = {}) {
  Layer layer;
  layer.drawables = {{{}, std::move(cloud), color}};
  return layer;
}

class Drawings : public test::GlTest {
 protected:
  struct Difference {
    int worst = 0;
    double mean = 0;
    double area = 0;  ///< relative
  };

  Image drawn(const Scene& scene, Drawing points, const calib::Lens& lens) {
    return ProjectorRenderer(context(), lens, points).render(scene, {});
  }

  Difference difference(const Scene& scene, const calib::Lens& lens, bool at_edges) {
    const Image gl = drawn(scene, Drawing::Gl, lens);
    const Image cpu = drawn(scene, Drawing::Cpu, lens);
    EXPECT_EQ(gl.rgb.size(), cpu.rgb.size());
    EXPECT_GT(test::whiteArea(gl), 100);
    Difference found;
    const auto row = 3 * static_cast<std::size_t>(gl.width);
    for (std::size_t i = row + 3; i + row + 3 < gl.rgb.size(); ++i) {
      const int apart = std::abs(int{gl.rgb[i]} - int{cpu.rgb[i]});
      found.mean += apart / static_cast<double>(gl.rgb.size());
      bool is_edge = false;
      for (const std::size_t k : {i - 3, i + 3, i - row, i + row}) {
        is_edge = is_edge || std::abs(int{gl.rgb[k]} - int{gl.rgb[i]}) > 8 ||
                  std::abs(int{cpu.rgb[k]} - int{cpu.rgb[i]}) > 8;
      }
      if (at_edges || !is_edge) found.worst = std::max(found.worst, apart);
    }
    std::printf("lit %.1f and %.1f px, difference at most %d, mean %.4f of 255\n",
                test::whiteArea(gl), test::whiteArea(cpu), found.worst, found.mean);
    found.area = test::whiteArea(cpu) / test::whiteArea(gl) - 1;
    return found;
  }

  /// Points: the same arithmetic, but for its rounding.
  void expectSame(const Scene& scene, const calib::Lens& lens) {
    const Difference found = difference(scene, lens, true);
    EXPECT_NEAR(found.area, 0, 1e-3);
    EXPECT_LE(found.worst, 3);  // 1/256 px is 1 level at an edge; blending rounds
    EXPECT_LT(found.mean, 0.15);
  }

  /// Shapes: edges are OpenGL's four samples, but the CPU's exact shares.
  void expectAlike(const Scene& scene, const calib::Lens& lens, double area = 2e-3) {
    const Difference found = difference(scene, lens, false);
    EXPECT_NEAR(found.area, 0, area);
    EXPECT_LE(found.worst, 9);  // colors between corners are interpolated elsewhere in the pixel
    EXPECT_LT(found.mean, 0.3);
  }

  const calib::Lens lens_ = test::lens(640, 400, 600, 320, 250, kBent);
};

TEST_F(Drawings, ofPointsAreTheSameImageOfOneColor) {
  for (const float size : {1.f, 3.f, 7.5f}) expectSame({{layerOf(wall(3000, size, false))}}, lens_);
}

TEST_F(Drawings, ofPointsAreTheSameImageWhereColorsOverlap) {
  expectSame({{layerOf(wall(20000, 3, true))}}, lens_);
}

TEST_F(Drawings, ofPointsAreTheSameImageTranslucent) {
  expectSame({{layerOf(wall(3000, 5, true), {1, 1, 1, 0.4f})}}, lens_);
}

TEST_F(Drawings, ofPointsEndAtTheFoldOfALensAndAtTheBorderAlike) {
  const calib::Lens folding = test::lens(640, 400, 300, 320, 200, kFolding);
  ASSERT_LT(folding.fold_radius, 1);
  expectSame({{layerOf(wall(3000, 3, false))}}, folding);
}

TEST_F(Drawings, ofSeveralLayersLieOverEachOtherAlike) {
  PointCloud below = wall(3000, 9, true);
  Layer draped = layerOf(wall(3000, 4, true), {});
  draped.placement = Placement::Drape;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = 2;
  T.linear() = Eigen::AngleAxisd(M_PI - 0.2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  draped.surface = SurfacePatch{"wall", Rigid<World, Surface>(T), {}};
  Layer viewed = layerOf(wall(2000, 3, true), {1, 1, 1, 0.5f});
  viewed.placement = Placement::Viewer;
  viewed.surface = draped.surface;
  viewed.p_viewer = {0.1, 0.2, -0.5};
  expectSame({{layerOf(below), draped, viewed}}, lens_);
}

Rigid<World, World> at(double x, double y, double z) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << x, y, z;
  T.rotate(Eigen::AngleAxisd(0.7 + x, Eigen::Vector3d(1, 2, 0.5).normalized()));
  return Rigid<World, World>(T);
}

/// One of everything, in the places of a raster.
std::vector<Drawable> everything() {
  const Eigen::Vector3f size(0.2f, 0.14f, 0.1f);
  const PointList points = {{-0.05f, 0, 0}, {0.05f, 0.03f, 0}, {0.02f, -0.06f, 0.02f}};
  const ColorList colors = {{1, 0, 0, 1}, {0, 1, 0, 1}, {0, 0, 1, 1}};
  PointCloud squares, boxes, spheres;
  squares.points = boxes.points = spheres.points = points;
  squares.colors = boxes.colors = spheres.colors = asBytes(colors);
  squares.size = boxes.size = spheres.size = 0.05f;
  squares.style = PointStyle::Squares;
  boxes.style = PointStyle::Boxes;
  spheres.style = PointStyle::Spheres;
  Lines thin{points, colors, 0.01f, true};
  thin.width_px = 2;
  const std::vector<Shape> shapes = {Arrow{},
                                     Cube{size},
                                     Sphere{size},
                                     Cylinder{size},
                                     Lines{points, colors, 0.02f, true},
                                     thin,
                                     ShapeList{ShapeList::Kind::Cubes, points, colors, 0.5f * size},
                                     ShapeList{ShapeList::Kind::Spheres, points, {}, 0.5f * size},
                                     Triangles{points, colors},
                                     squares,
                                     boxes,
                                     spheres};
  std::vector<Drawable> all;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const double x = 0.3 * (static_cast<double>(i % 4) - 1.5);
    const double y = 0.3 * (static_cast<double>(i / 4) - 1);
    all.push_back({at(x, y, 1.5), shapes[i], {1, 1, 0.2f, 1}});
  }
  const auto letters = std::make_shared<const Body>(Typeface().block(U"Ärgi&8\n%@", 0.08));
  all.push_back({at(0.6, 0.33, 1.4), Text{letters}, {0, 1, 1, 1}});
  std::get<Arrow>(all[0].shape) = {0.2f, 0.04f, 0.08f, 0.06f};
  return all;
}

TEST_F(Drawings, ofEveryShapeAreAlikeButForTheirEdges) {
  Layer layer;
  layer.drawables = everything();
  expectAlike({{layer}}, lens_);
  expectAlike({{layer}}, test::fisheye(640, 400, 420, 320, 250, {-0.03, 0.01, -0.004, 0.0005}));
  for (Drawable& drawable : layer.drawables) drawable.color.a = 0.5f;
  expectAlike({{layer}}, lens_);
}

TEST_F(Drawings, ofSmallThingsByTheThousandAreAlike) {
  for (const PointStyle style : {PointStyle::Squares, PointStyle::Spheres, PointStyle::Boxes}) {
    PointCloud cloud = wall(800, 0.012f, true);
    cloud.style = style;
    Layer layer = layerOf(cloud);
    layer.drawables[0].pose = at(0.02, 0.01, 0);
    const Difference apart = difference({{layer}}, lens_, false);
    EXPECT_NEAR(apart.area, 0, 5e-3);
    EXPECT_LT(apart.mean, 0.3);
    layer.placement = Placement::Drape;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation().z() = 2;
    T.linear() = Eigen::AngleAxisd(M_PI - 0.2, Eigen::Vector3d::UnitX()).toRotationMatrix();
    layer.surface = SurfacePatch{"wall", Rigid<World, Surface>(T), {}};
    layer.drawables[0].color.a = 0.5f;
    const Difference draped = difference({{layer}}, lens_, false);
    EXPECT_NEAR(draped.area, 0, 7e-3);  // each GPU has its four samples elsewhere
    EXPECT_LT(draped.mean, 0.3);
  }
}

TEST_F(Drawings, onASurfaceAreAlike) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = 1.8;
  T.linear() = Eigen::AngleAxisd(M_PI - 0.3, Eigen::Vector3d::UnitX()).toRotationMatrix();
  Layer draped;
  draped.drawables = everything();
  draped.placement = Placement::Drape;
  draped.surface = SurfacePatch{
      "wall", Rigid<World, Surface>(T), {{-0.6, -0.4}, {0.5, -0.3}, {0.1, 0.1}, {0.3, 0.4}}};
  Layer viewed = draped;
  viewed.placement = Placement::Viewer;
  viewed.p_viewer = {0.3, 0.2, -0.5};
  expectAlike({{draped}}, lens_, 0.01);
  expectAlike({{viewed}}, lens_, 0.01);
}

TEST_F(Drawings, leaveWhatFallsOnANearerSurfaceDarkAlike) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()).toRotationMatrix();
  T.translation().z() = 1.8;
  Layer floor;
  floor.placement = Placement::Drape;
  floor.surface = SurfacePatch{"floor", Rigid<World, Surface>(T), {}};
  floor.drawables = {{Rigid<World, World>(T), Cube{{1, 0.6f, 0.01f}}, {}}};
  T.translation().z() = 1.2;
  const SurfacePatch table{
      "table", Rigid<World, Surface>(T), {{-0.2, -0.1}, {0.2, -0.1}, {0.2, 0.1}, {-0.2, 0.1}}};
  T.translation().z() = 1.4;
  const SurfacePatch shelf{
      "shelf", Rigid<World, Surface>(T), {{0, 0}, {0.4, 0}, {0.4, 0.2}, {0, 0.2}}};
  Scene scene{{floor}, {*floor.surface, table, shelf}};
  expectAlike(scene, lens_);
  const Image image = drawn(scene, Drawing::Cpu, lens_);
  scene.surfaces.clear();
  const double shaded = test::whiteArea(drawn(scene, Drawing::Cpu, lens_)) - test::whiteArea(image);
  EXPECT_GT(shaded, 0.9 * 0.4 * 0.2 * std::pow(600 / 1.2, 2)) << "table, and part of the shelf";
}

TEST_F(Drawings, ofPointsAmongSolidsAreAlike) {
  Layer solid;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0.1, 0, 1.6;
  solid.drawables = {{Rigid<World, World>(T), Cube{Eigen::Vector3f::Constant(0.4f)}, {}}};
  const Scene scene{{solid, layerOf(wall(40000, 3, true))}, {}};
  const Difference found = difference(scene, lens_, false);
  EXPECT_NEAR(found.area, 0, 2e-3);
  EXPECT_LT(found.mean, 0.3);
}

TEST_F(Drawings, ofPointsAreCutAtASurfacesOutlineAlike) {
  Layer cut = layerOf(wall(40000, 3, false));
  cut.placement = Placement::Drape;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = 1.8;
  cut.surface =
      SurfacePatch{"wall", Rigid<World, Surface>(T), {{-0.4, -0.3}, {0.5, -0.2}, {0, 0.4}}};
  expectAlike({{cut}, {}}, lens_, 5e-3);
}

TEST_F(Drawings, ofSeveralProjectorsMayBeBegunBeforeAnyIsFinished) {
  const Scene scene{{layerOf(wall(5000, 3, true))}, {}};
  calib::Lens narrow = lens_;
  narrow.width /= 2;
  for (const Drawing by : {Drawing::Gl, Drawing::Cpu}) {
    ProjectorRenderer left(context(), lens_, by), right(context(), narrow, by);
    const Image left_alone = left.render(scene, {}), right_alone = right.render(scene, {});
    EXPECT_GT(test::whiteArea(right_alone), 100);
    left.render({}, {});  // or the same would not be drawn again
    right.render({}, {});
    left.begin(scene, {});
    right.begin(scene, {});
    Image image;
    right.finish(image);
    EXPECT_EQ(image.rgb, right_alone.rgb);
    left.finish(image);
    EXPECT_EQ(image.rgb, left_alone.rgb);
  }
}

TEST_F(Drawings, afterOthersAreAsIfTheyWereTheFirst) {
  test::ChangingScene changing;
  ProjectorRenderer renderer(context(), lens_, Drawing::Gl);
  for (int i = 0; i < 15; ++i) {
    const auto T = changing.T_projector_world();
    const Image image = renderer.render(changing.scene, T);
    ASSERT_EQ(image.rgb,
              ProjectorRenderer(context(), lens_, Drawing::Gl).render(changing.scene, T).rgb)
        << "image " << i;
    changing.change();
  }
}

TEST_F(Drawings, ofAListWhosePointsOrColorsChangeAreNew) {
  ProjectorRenderer renderer(context(), lens_, Drawing::Gl);
  PointCloud cloud = wall(5000, 3, true);
  for (int i = 0; i < 4; ++i) {
    const Scene scene{{layerOf(cloud)}};
    EXPECT_EQ(renderer.render(scene, {}).rgb, drawn(scene, Drawing::Gl, lens_).rgb) << i;
    if (i % 2 == 0) cloud.colors.edit()[7] = {255, 0, 0, 255};
    if (i % 2 == 1) cloud.points.edit()[7].x() += 0.05f;
  }
}

TEST_F(Drawings, leaveOutWhatIsNotFiniteAlike) {
  for (const PointStyle style :
       {PointStyle::Points, PointStyle::Squares, PointStyle::Boxes, PointStyle::Spheres}) {
    PointCloud cloud = wall(800, style == PointStyle::Points ? 3 : 0.012f, true);
    cloud.style = style;
    for (std::size_t i = 0; i < 800; i += 7) {
      cloud.points.edit()[i][static_cast<Eigen::Index>(i % 3)] = i % 2 == 0 ? std::nanf("") : 1e38f;
    }
    const Difference found = difference({{layerOf(cloud)}}, lens_, false);
    EXPECT_NEAR(found.area, 0, 5e-3) << static_cast<int>(style);
    EXPECT_LT(found.mean, 0.4) << static_cast<int>(style);
  }
}

/// From before the lens, where one fills much of the image, to far away.
TEST_F(Drawings, ofThingsNearTheLensAreAlike) {
  for (const PointStyle style : {PointStyle::Squares, PointStyle::Spheres, PointStyle::Boxes}) {
    PointCloud cloud;
    cloud.style = style;
    cloud.size = 0.03f;
    for (int i = 0; i < 600; ++i) {
      const float z = -0.1f + 0.004f * static_cast<float>(i);
      cloud.points.emplace_back(0.4f * z * std::sin(2.f * static_cast<float>(i)),
                                0.3f * z * std::cos(3.f * static_cast<float>(i)), z);
      cloud.colors.push_back(
          {static_cast<std::uint8_t>(i), 255, static_cast<std::uint8_t>(i / 3), 255});
    }
    const Difference found = difference({{layerOf(cloud)}}, lens_, false);
    EXPECT_NEAR(found.area, 0, 5e-3) << static_cast<int>(style);
    EXPECT_LT(found.mean, 1) << static_cast<int>(style);
  }
}

TEST_F(Drawings, goWhereMeasuringSaysOrToTheCpuWithoutAGpuAndSayWhy) {
  const ProjectorRenderer renderer(context(), lens_, Drawing::Measured);
  const bool is_software = isSoftware(context().description());
  EXPECT_NE(renderer.description().find(is_software ? "drawn by the CPU (OpenGL is software: "
                                                    : " ms by the CPU"),
            std::string::npos)
      << renderer.description();
  EXPECT_EQ(ProjectorRenderer(context(), lens_, Drawing::Cpu).description(),
            "drawn by the CPU (configured)");
}

}  // namespace
}  // namespace afterglow::render::drawings_gl_test

// Clouds drawn by the CPU and by OpenGL are the same picture, alone and among other things.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render {
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
  cloud.colors = std::move(colors);
  return cloud;
}

Layer layerOf(PointCloud cloud, const Color& color = {}) {
  Layer layer;
  layer.drawables = {{{}, std::move(cloud), color}};
  return layer;
}

class PaintedPoints : public test::GlTest {
 protected:
  struct Difference {
    int worst = 0;
    double mean = 0;
  };

  Image drawn(const Scene& scene, Drawing points, const calib::Lens& lens) {
    return ProjectorRenderer(context(), lens, points).render(scene, {});
  }

  void expectSame(const Scene& scene, const calib::Lens& lens, int worst = 3) {
    const Image gl = drawn(scene, Drawing::Gl, lens);
    const Image cpu = drawn(scene, Drawing::Cpu, lens);
    ASSERT_EQ(gl.rgb.size(), cpu.rgb.size());
    Difference difference;
    for (std::size_t i = 0; i < gl.rgb.size(); ++i) {
      const int apart = std::abs(int{gl.rgb[i]} - int{cpu.rgb[i]});
      difference.worst = std::max(difference.worst, apart);
      difference.mean += apart / static_cast<double>(gl.rgb.size());
    }
    std::printf("lit %.0f px, difference at most %d, mean %.4f of 255\n", test::whiteArea(gl),
                difference.worst, difference.mean);
    EXPECT_GT(test::whiteArea(gl), 100);
    EXPECT_NEAR(test::whiteArea(cpu) / test::whiteArea(gl), 1, 1e-3);
    EXPECT_LE(difference.worst, worst);  // 1/256 px is 1 level at an edge; blending rounds
    EXPECT_LT(difference.mean, 0.15);
  }

  const calib::Lens lens_ = test::lens(640, 400, 600, 320, 250, kBent);
};

TEST_F(PaintedPoints, areTheSamePictureOfOneColor) {
  for (const float size : {1.f, 3.f, 7.5f}) expectSame({{layerOf(wall(3000, size, false))}}, lens_);
}

TEST_F(PaintedPoints, areTheSamePictureWhereColorsOverlap) {
  expectSame({{layerOf(wall(20000, 3, true))}}, lens_);
}

TEST_F(PaintedPoints, areTheSamePictureTranslucent) {
  expectSame({{layerOf(wall(3000, 5, true), {1, 1, 1, 0.4f})}}, lens_);
}

TEST_F(PaintedPoints, endAtTheFoldOfALensAndAtTheBorderAlike) {
  const calib::Lens folding = test::lens(640, 400, 300, 320, 200, kFolding);
  ASSERT_LT(folding.fold_radius, 1);
  expectSame({{layerOf(wall(3000, 3, false))}}, folding);
}

TEST_F(PaintedPoints, ofSeveralLayersLieOverEachOtherAlike) {
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

TEST_F(PaintedPoints, areCutAtASurfacesOutlineAndLieBelowWhatComesLater) {
  Layer cut = layerOf(wall(40000, 3, true));
  cut.placement = Placement::Drape;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation().z() = 1.8;
  cut.surface =
      SurfacePatch{"wall", Rigid<World, Surface>(T), {{-0.4, -0.3}, {0.5, -0.2}, {0, 0.4}}};
  Layer solid;
  solid.drawables = {{{}, Sphere{}, {1, 0, 0, 0.5f}}};
  T.translation() << 0.2, 0, 2;
  solid.drawables[0].pose = Rigid<World, World>(T);
  expectSame({{cut, solid}}, lens_);
}

TEST_F(PaintedPoints, areLeftToOpenGlWhereSolidsMayHideThem) {
  Layer solid;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0.1, 0, 1.6;
  solid.drawables = {{Rigid<World, World>(T), Sphere{Eigen::Vector3f::Constant(0.5f)}, {}}};
  expectSame({{solid, layerOf(wall(40000, 3, true))}}, lens_, 0);
  solid.drawables.push_back({{}, wall(40000, 3, true), {}});
  expectSame({{solid}}, lens_, 0);
}

TEST_F(PaintedPoints, goWhereMeasuringSaysAndSayWhy) {
  const ProjectorRenderer renderer(context(), lens_, Drawing::Measured);
  EXPECT_NE(renderer.description().find(" ms by the CPU"), std::string::npos)
      << renderer.description();
  EXPECT_EQ(ProjectorRenderer(context(), lens_, Drawing::Cpu).description(),
            "points by the CPU (configured)");
}

}  // namespace
}  // namespace afterglow::render

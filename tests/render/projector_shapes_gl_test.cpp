// Outlines of shapes on the projector's image, against cv::projectPoints; what must not be drawn;
// placement, clipping, transparency.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "tests/support/gl_context.hpp"
#include "tests/support/image_measures.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::projector_shapes_gl_test {
namespace {

using test::pixelAt;
using Points = std::vector<Eigen::Vector3d>;

Rigid<World, World> at(const Eigen::Vector3d& p, double yaw = 0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = p;
  T.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return Rigid<World, World>(T);
}

const std::vector<double> kStrong = {-0.35, 0.12, 0.002, -0.0015, -0.03};

class ProjectorShapes : public test::GlTest {
 protected:
  Image draw(const calib::Lens& lens, std::vector<Drawable> drawables,
             const Rigid<Projector, World>& T = {}) {
    Layer layer;
    layer.drawables = std::move(drawables);
    return ProjectorRenderer(context(), lens).render({{layer}}, T);
  }

  /// Area and centroid of white content against those of an outline that OpenCV projects; the
  /// outline's edges are given as many points, so that the lens bends them.
  void expectOutline(const Image& image, const calib::Lens& lens, const Points& corners_optical,
                     double area_tolerance = 0.002) {
    Points points;
    for (std::size_t i = 0; i < corners_optical.size(); ++i) {
      const Eigen::Vector3d &a = corners_optical[i],
                            &b = corners_optical[(i + 1) % corners_optical.size()];
      for (int k = 0; k < 200; ++k) points.push_back(a + (b - a) * k / 200);
    }
    double area = 0;
    Eigen::Vector2d center = Eigen::Vector2d::Zero();
    const auto pixels = test::projectWithOpenCv(lens, points);
    const Eigen::Vector2d o = pixels[0];
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Eigen::Vector2d a = pixels[i] - o, b = pixels[(i + 1) % pixels.size()] - o;
      const double cross = a.x() * b.y() - a.y() * b.x();
      area += cross / 2;
      center += (a + b) * cross / 6;
    }
    center = center / area + o;
    const auto found = test::centroid(image, {640, 400}, 700);
    ASSERT_TRUE(found);
    EXPECT_LT((*found - center).norm(), 0.1) << *found << " instead of " << center;
    EXPECT_NEAR(test::whiteArea(image) / std::abs(area), 1, area_tolerance);
  }
};

TEST_F(ProjectorShapes, trianglesCoverTheirOutline) {
  for (const auto& lens : {test::viewsonic(), test::viewsonic(kStrong),
                           test::lens(1280, 800, 700, 640, 400, {-0.3, 0.05, 0, 0, 0}),
                           test::fisheye(1280, 800, 500, 600, 420, {-0.03, 0.01, 0, 0})}) {
    Triangles triangles;
    const double s = 1900 / lens.K(0, 0), y = (400 - lens.K(1, 2)) / lens.K(1, 1);
    const Points corners = {{-0.3 * s, (y - 0.1) * 1.5, 1.5},
                            {0.42 * s, (y - 0.05) * 1.7, 1.7},
                            {0.05 * s, (y + 0.15) * 1.4, 1.4}};
    for (const auto& p : corners) triangles.points.push_back(p.cast<float>());
    expectOutline(draw(lens, {{{}, triangles, {}}}), lens, corners);
  }
}

TEST_F(ProjectorShapes, cubesCoverTheirSilhouette) {
  const calib::Lens lens = test::viewsonic(kStrong);
  const auto T_world_projector = test::lookAt<Projector>({-1.5, -0.6, 1.1}, {0, 0, -0.4});
  const auto T = T_world_projector.inverse();
  const Eigen::Vector3d size(0.3, 0.2, 0.15);
  const auto pose = at({0.05, 0.02, 0.1}, 0.4);
  // Its hull on the image, from corners and points of edges.
  std::vector<cv::Point2f> pixels;
  for (int i = 0; i < 12 * 101; ++i) {
    const int edge = i % 12, axis = edge / 4, step = i / 12;
    Eigen::Vector3d p;
    p[axis] = step / 100.0 - 0.5;
    p[(axis + 1) % 3] = edge & 1 ? 0.5 : -0.5;
    p[(axis + 2) % 3] = edge & 2 ? 0.5 : -0.5;
    const Eigen::Vector3d p_optical = T * (pose * Eigen::Vector3d(p.cwiseProduct(size)));
    const Eigen::Vector2d pixel = test::projectWithOpenCv(lens, {p_optical})[0];
    pixels.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
  }
  std::vector<cv::Point2f> hull;
  cv::convexHull(pixels, hull);
  const cv::Moments moments = cv::moments(hull);
  const Image image = draw(lens, {{pose, Cube{size.cast<float>()}, {}}}, T);
  const auto found = test::centroid(image, {640, 400}, 700);
  ASSERT_TRUE(found);
  const Eigen::Vector2d expected(moments.m10 / moments.m00, moments.m01 / moments.m00);
  EXPECT_LT((*found - expected).norm(), 0.1);
  EXPECT_NEAR(test::whiteArea(image) / moments.m00, 1, 0.005);
}

TEST_F(ProjectorShapes, linesAreAsWideAsTheySay) {
  for (const auto& lens : {test::viewsonic(), test::viewsonic(kStrong)}) {
    Lines lines;
    lines.width = 0.02f;
    const Eigen::Vector3d a(-0.3, -0.45, 1.5), b(0.4, -0.25, 1.5);
    lines.points = {a.cast<float>(), b.cast<float>()};
    // Facing the projector: across the line and the sight of each end.
    const Eigen::Vector3d at_a = (b - a).cross(a).normalized() * 0.01;
    const Eigen::Vector3d at_b = (b - a).cross(b).normalized() * 0.01;
    expectOutline(draw(lens, {{{}, lines, {}}}), lens, {a - at_a, b - at_b, b + at_b, a + at_a},
                  0.01);
  }
}

TEST_F(ProjectorShapes, spheresCylindersAndArrowsHaveTheirSizes) {
  const calib::Lens lens = test::lens(1280, 800, 1900, 640, 400);
  const auto T = test::lookAt<Projector>({0, -3, 0}, {0, 0, 0}).inverse();
  const double pixels_per_m2 = std::pow(1900 / 3.0, 2);
  const auto area = [&](Shape shape) {
    return test::whiteArea(draw(lens, {{{}, std::move(shape), {}}}, T)) / pixels_per_m2;
  };
  // Near things look larger: the tolerance is theirs, and the polygons' instead of circles.
  EXPECT_NEAR(area(Sphere{{0.4f, 0.1f, 0.2f}}), M_PI * 0.2 * 0.1, 0.02 * M_PI * 0.02);
  EXPECT_NEAR(area(Cylinder{{0.3f, 0.02f, 0.4f}}), 0.3 * 0.4, 0.02 * 0.12);
  EXPECT_NEAR(area(Arrow{0.5f, 0.02f, 0.06f, 0.1f}), 0.4 * 0.02 + 0.1 * 0.06 / 2, 0.03 * 0.011);
}

TEST_F(ProjectorShapes, contentThroughTheLensIsCutNotMirrored) {
  // From behind the projector through its lens to the floor ahead.
  const calib::Lens lens = test::lens(1280, 800, 900, 640, 400, kStrong);
  Triangles triangles;
  triangles.points = {{-0.2f, 0.3f, -3}, {0.2f, 0.3f, -3}, {0.2f, 0.3f, 2},
                      {-0.2f, 0.3f, -3}, {0.2f, 0.3f, 2},  {-0.2f, 0.3f, 2}};
  const Image image = draw(lens, {{{}, triangles, {}}});
  EXPECT_GT(test::brightness(image, 640, 799), 0) << "the near part reaches the lower border";
  for (int v = 0; v < 500; ++v) ASSERT_EQ(test::brightness(image, 640, v), 0) << v;
  triangles.points.edit().resize(3);
  for (auto& p : triangles.points.edit()) p.z() = -2;
  EXPECT_EQ(test::litPixels(draw(lens, {{{}, triangles, {}}})), 0);
}

TEST_F(ProjectorShapes, contentBeyondTheFoldDoesNotComeBack) {
  const calib::Lens lens = test::lens(1280, 800, 700, 640, 400, {-0.35, 0, 0, 0, 0});
  // r = 1.69 is projected to the image's center by the bare model.
  Cube cube;
  cube.size = Eigen::Vector3f::Constant(0.2f);
  PointCloud cloud;
  cloud.style = PointStyle::Points;
  cloud.size = 9;
  cloud.points = {{1.69f, 0, 1}};
  EXPECT_EQ(test::litPixels(draw(lens, {{at({1.69, 0, 1}), cube, {}}, {{}, cloud, {}}})), 0);
  // Within the square around the fold, but not within the fold: 371 px from the center.
  cube.size = Eigen::Vector3f::Constant(0.05f);
  EXPECT_EQ(test::litPixels(draw(lens, {{at({0.92, 0.92, 1}), cube, {}}})), 0);
  // A bar across the fold ends there: 455.5 px from the center.
  cube.size = {10, 0.02f, 0.02f};
  const Image image = draw(lens, {{at({0, 0, 1}), cube, {}}});
  EXPECT_GT(test::brightness(image, 640 + 450, 400), 0);
  EXPECT_EQ(test::brightness(image, 640 + 458, 400), 0);
}

TEST_F(ProjectorShapes, pointsReachOverTheBorder) {
  const calib::Lens lens = test::viewsonic();
  PointCloud cloud;
  cloud.style = PointStyle::Points;
  cloud.size = 21;
  cloud.points = {(*calib::unproject(lens, {-5, 300})).cast<float>()};
  const Image image = draw(lens, {{{}, cloud, {}}});
  // From -15.5 to 5.5: six columns of 21 are on the image.
  EXPECT_NEAR(test::whiteArea(image), 6 * 21, 0.5);
}

// ------------------------------------------------------------------------------------- placement
class Placed : public ProjectorShapes {
 protected:
  static Layer floorLayer(Placement placement) {
    Layer layer;
    layer.name = "/path";
    layer.placement = placement;
    layer.surface = SurfacePatch{"floor", {}, {}};
    layer.p_viewer = {1.2, -1.5, 1.7};
    return layer;
  }
  Image draw(const Layer& layer) {
    return ProjectorRenderer(context(), lens_).render({{layer}}, T_.inverse());
  }
  Eigen::Vector2d pixel(double x, double y) const {
    return *calib::project(lens_, T_.inverse() * Eigen::Vector3d(x, y, 0));
  }
  Points optical(const std::vector<Eigen::Vector2d>& outline) const {
    Points points;
    for (const auto& p : outline) {
      points.push_back(T_.inverse() * Eigen::Vector3d(p.x(), p.y(), 0));
    }
    return points;
  }

  const calib::Lens lens_ = test::lens(1280, 800, 1100, 640, 500, {-0.2, 0.05, 0.001, -0.001, 0});
  const Rigid<World, Projector> T_ = test::lookAt<Projector>({0, 0, 1.6}, {1.4, 0, 0});
};

TEST_F(Placed, drapedCubeCoversItsFootprint) {
  Layer layer = floorLayer(Placement::Drape);
  layer.drawables = {{at({1.3, 0.1, 0.4}), Cube{{0.3f, 0.2f, 0.25f}}, {}}};
  expectOutline(draw(layer), lens_, optical({{1.15, 0}, {1.45, 0}, {1.45, 0.2}, {1.15, 0.2}}));
}

TEST_F(Placed, linesHaveNoNotchesInTheirCorners) {
  const Eigen::Vector2d corner(1.35, 0.05);
  for (const Placement placement : {Placement::Direct, Placement::Drape}) {
    for (const double turn : {M_PI / 2, -M_PI / 2, M_PI / 3, -M_PI / 3, 2.5, -2.5}) {
      SCOPED_TRACE(std::to_string(turn) + (placement == Placement::Drape ? " draped" : ""));
      const Eigen::Vector2d from = corner - Eigen::Vector2d(0.3, 0);
      const Eigen::Vector2d to = corner + 0.3 * Eigen::Vector2d(std::cos(turn), std::sin(turn));
      Lines lines;
      lines.strip = true;
      lines.width = 0.1f;
      for (const auto& p : {from, corner, to}) {
        lines.points.push_back(Eigen::Vector3d(p.x(), p.y(), 0).cast<float>());
      }
      Layer layer = floorLayer(placement);
      if (placement == Placement::Direct) layer.surface.reset();
      layer.drawables = {{{}, lines, {}}};
      const Image image = draw(layer);
      // On the outer side, within the line's half width, which is 20 pixels at least.
      const Eigen::Vector2d p = pixel(corner.x(), corner.y());
      const Eigen::Vector2d a = (p - pixel(from.x(), from.y())).normalized(),
                            b = (p - pixel(to.x(), to.y())).normalized();
      const Eigen::Vector2d outside = p + 12 * (a + b).normalized();
      const auto column = static_cast<std::size_t>(std::lround(outside.x())),
                 row = static_cast<std::size_t>(std::lround(outside.y()));
      EXPECT_EQ(image.rgb[3 * (row * static_cast<std::size_t>(image.width) + column)], 255);
    }
  }
}

TEST_F(Placed, viewerSeesContentWhereItWouldBe) {
  Layer layer = floorLayer(Placement::Viewer);
  const Eigen::Vector3d p(1.3, -0.1, 0.3);
  layer.drawables = {{at(p), Sphere{Eigen::Vector3f::Constant(0.02f)}, {}}};
  const Eigen::Vector3d ray = p - layer.p_viewer;
  const Eigen::Vector3d lands = layer.p_viewer - ray * layer.p_viewer.z() / ray.z();
  const auto found = test::centroid(draw(layer), {640, 400}, 700);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - pixel(lands.x(), lands.y())).norm(), 0.2);
}

TEST_F(Placed, contentOverTheViewersEyeIsCut) {
  Layer layer = floorLayer(Placement::Viewer);
  layer.drawables = {{at({1.3, -0.1, 2.5}), Cube{}, {}}};
  EXPECT_EQ(test::litPixels(draw(layer)), 0);
  // Half of this one is over the eye; the rest is drawn, and stays on the far side.
  layer.drawables = {{at({1.3, -0.1, 1.0}), Cube{{0.02f, 0.02f, 2.0f}}, {}}};
  EXPECT_GT(test::litPixels(draw(layer)), 100);
}

TEST_F(Placed, isClippedToAnOutlineThatIsNotConvex) {
  Layer layer = floorLayer(Placement::Drape);
  const std::vector<Eigen::Vector2d> outline = {
      {1, -0.4}, {1.8, -0.4}, {1.8, 0.4}, {1.4, 0}, {1, 0.4}};
  layer.surface->polygon = outline;
  layer.drawables = {{at({1.5, 0, 0.1}), Cube{{8, 8, 0.1f}}, {}}};
  expectOutline(draw(layer), lens_, optical(outline));
  // The same for light that is not flattened, and for points.
  layer.placement = Placement::Direct;
  expectOutline(draw(layer), lens_, optical(outline));
  PointCloud cloud;
  cloud.style = PointStyle::Points;
  cloud.size = 9;
  cloud.points = {{1.4f, 0.2f, 0}, {1.2f, 0, 0}};
  layer.drawables = {{{}, cloud, {}}};
  EXPECT_NEAR(test::whiteArea(draw(layer)), 81, 0.5) << "one is in the notch";
}

TEST_F(Placed, outlineThroughTheLensStillClips) {
  Layer layer = floorLayer(Placement::Drape);
  layer.surface->polygon = {{-3, -3}, {1.4, -3}, {1.4, 3}, {-3, 3}};  // reaches behind
  layer.drawables = {{at({1.5, 0, 0.1}), Cube{{8, 8, 0.1f}}, {}}};
  const Image image = draw(layer);
  const auto line = pixel(1.4, 0);
  const int u = static_cast<int>(std::lround(line.x())), v = static_cast<int>(line.y());
  EXPECT_EQ(test::brightness(image, u, v + 2), 765);
  EXPECT_EQ(test::brightness(image, u, v - 2), 0);
  EXPECT_EQ(test::brightness(image, u, 799), 765);
}

TEST_F(Placed, flattenedThingsHideByHeight) {
  Layer layer = floorLayer(Placement::Drape);
  layer.drawables = {{at({1.4, 0, 0.5}), Cube{{0.2f, 0.2f, 0.1f}}, {1, 0, 0, 1}},
                     {at({1.4, 0, 0.1}), Cube{{0.4f, 0.4f, 0.1f}}, {0, 1, 0, 1}}};
  const Image image = draw(layer);
  const auto inner = pixel(1.4, 0), outer = pixel(1.4, 0.15);
  EXPECT_EQ(pixelAt(image, std::lround(inner.x()), std::lround(inner.y()))[0], 255);
  EXPECT_EQ(pixelAt(image, std::lround(outer.x()), std::lround(outer.y()))[1], 255);
}

TEST_F(Placed, everyPixelTakesATranslucentThingOnce) {
  Layer layer = floorLayer(Placement::Drape);
  Lines lines;
  lines.width = 0.1f;
  lines.points = {{1.2f, -0.2f, 0}, {1.6f, -0.2f, 0}, {1.2f, 0.2f, 0}, {1.6f, 0.2f, 0}};
  layer.drawables = {{{}, lines, {1, 1, 1, 0.5f}}};
  const Image image = draw(layer);
  for (const std::uint8_t value : image.rgb) ASSERT_LE(value, 128);
  layer.drawables = {{at({1.4, 0, 0.2}), Cube{Eigen::Vector3f::Constant(0.3f)}, {1, 1, 1, 0.5f}}};
  layer.placement = Placement::Direct;
  const Image cube = draw(layer);
  EXPECT_EQ(*std::max_element(cube.rgb.begin(), cube.rgb.end()), 128);
}

TEST_F(Placed, nothingIsBlack) {
  const Image image = ProjectorRenderer(context(), lens_).render({}, T_.inverse());
  EXPECT_EQ(image.width, 1280);
  EXPECT_EQ(image.height, 800);
  EXPECT_EQ(test::litPixels(image), 0);
}

}  // namespace
}  // namespace afterglow::render::projector_shapes_gl_test

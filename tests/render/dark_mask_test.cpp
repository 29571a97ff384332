#include "render/paint/dark_mask.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "render/scene/relief.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::dark_mask_test {
namespace {

const Rigid<Projector, World> kAtOrigin;  // the lens looks along the world's z

Image white(const calib::Lens& lens) {
  Image image{lens.width, lens.height, {}};
  image.rgb.assign(3 * static_cast<std::size_t>(lens.width * lens.height), 255);
  return image;
}

Image masked(const calib::Lens& lens, const std::vector<AvoidedPoints>& avoided,
             const Rigid<Projector, World>& T_projector_world = kAtOrigin) {
  DarkMask mask(lens);
  mask.draw(avoided, T_projector_world);
  Image image = white(lens);
  mask.apply(image);
  return image;
}

bool isDark(const Image& image, int x, int y) {
  return image.rgb[3 * static_cast<std::size_t>(y * image.width + x)] == 0;
}

/// How near a ray of light, which begins at the lens, comes to a point.
double nearest(const Eigen::Vector3d& ray, const Eigen::Vector3d& p) {
  return ray.dot(p) > 0 ? ray.cross(p).norm() / ray.norm() : p.norm();
}

/// Every fifth ray is dark if it comes nearer to a point than the padding, and lit if it stays away
/// by `times` the padding and twelve pixels more.
void expectKept(const calib::Lens& lens, const PointList& points, float padding, double times) {
  const Image image = masked(lens, {{{}, points, padding}});
  int dark = 0, lit = 0;
  for (int y = 0; y < lens.height; y += 5) {
    for (int x = 0; x < lens.width; x += 5) {
      const auto ray = calib::unproject(lens, {x, y});
      if (!ray) continue;
      bool is_hit = false, is_far = true;
      for (const Eigen::Vector3f& point : points) {
        const Eigen::Vector3d p = point.cast<double>();
        const double away = nearest(*ray, p);
        is_hit = is_hit || away < static_cast<double>(padding);
        is_far =
            is_far && away > times * static_cast<double>(padding) + 12 * p.norm() / lens.K(0, 0);
      }
      if (is_hit) {
        ++dark;
        ASSERT_TRUE(isDark(image, x, y)) << x << " " << y << " hits what is to be avoided";
      } else if (is_far) {
        ++lit;
        ASSERT_FALSE(isDark(image, x, y)) << x << " " << y << " hits nothing";
      }
    }
  }
  EXPECT_GT(dark, 10);
  EXPECT_GT(lit, 1000);
}

PointList someInFront(const calib::Lens& lens, double least_m, double greatest_m) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(-0.1, 1.1), depth(least_m, greatest_m);
  PointList points;
  while (points.size() < 12) {
    const auto ray =
        calib::unproject(lens, {share(random) * lens.width, share(random) * lens.height});
    if (ray) points.push_back((*ray * depth(random)).cast<float>());
  }
  return points;
}

TEST(DarkMask, isDarkWhereLightComesNearerThanThePadding) {
  for (const std::vector<double>& D :
       {std::vector<double>{}, {-0.2, 0.05, 0.001, -0.001, 0}, {0.15, 0.02, 0, 0, 0}}) {
    const calib::Lens lens = test::lens(640, 400, 550, 330, 180, D);
    expectKept(lens, someInFront(lens, 1, 4), 0.1f, 2);
    expectKept(lens, someInFront(lens, 1, 4), 0.02f, 2);
  }
  expectKept(test::viewsonic(), someInFront(test::viewsonic(), 1, 3), 0.05f, 1.5);
}

TEST(DarkMask, isDarkThroughAFisheyeToo) {
  const calib::Lens lens = test::fisheye(640, 400, 250, 320, 200, {0.02, 0.001, 0, 0});
  expectKept(lens, someInFront(lens, 1, 3), 0.1f, 1.7);
}

TEST(DarkMask, reachesInFromPointsBesideTheImage) {
  const calib::Lens lens = test::lens(640, 400, 640, 320, 200);
  // 20 px beside the border, 28 degrees off the axis: its padding is seen under 2 x 5 degrees.
  const Image image = masked(lens, {{{}, PointList{{-1.0625f, 0, 2}}, 0.2f}});
  EXPECT_TRUE(isDark(image, 0, 200));
  EXPECT_TRUE(isDark(image, 48, 200));
  EXPECT_FALSE(isDark(image, 62, 200));
  EXPECT_FALSE(isDark(image, 0, 290));
}

TEST(DarkMask, isWholeWhereThePaddingSurroundsTheLensAndEmptyForWhatIsBehindIt) {
  const calib::Lens lens = test::lens(640, 400, 640, 320, 200);
  DarkMask mask(lens);
  mask.draw({{{}, PointList{{0, 0, -0.1f}}, 0.2f}}, kAtOrigin);
  EXPECT_EQ(mask.share(), 1);
  Image image = white(lens);
  mask.apply(image);
  EXPECT_FALSE(isLit(image));
  mask.draw({{{}, PointList{{0, 0, -0.3f}, {0.1f, 1, -2}}, 0.2f}}, kAtOrigin);
  EXPECT_EQ(mask.share(), 0);
  image = white(lens);
  mask.apply(image);
  EXPECT_EQ(image.rgb, white(lens).rgb);
}

TEST(DarkMask, leavesOutPointsThatAreNotFinite) {
  const float kNan = std::numeric_limits<float>::quiet_NaN();
  const float kInf = std::numeric_limits<float>::infinity();
  const calib::Lens lens = test::lens(320, 200, 300, 160, 100);
  DarkMask mask(lens);
  mask.draw({{{}, PointList{{kNan, 0, 1}, {0, 0, kInf}, {kInf, 0, 1}, {0, kNan, kNan}}, 0.2f}},
            kAtOrigin);
  EXPECT_EQ(mask.share(), 0);
}

TEST(DarkMask, movesWithTheProjector) {
  const calib::Lens lens = test::lens(640, 400, 640, 320, 200);
  const auto T_world_projector = test::lookAt<Projector>({1, 2, 3}, {4, 2, 0});
  const Eigen::Vector3d ahead = T_world_projector * Eigen::Vector3d(0, 0, 2);
  const std::vector<AvoidedPoints> avoided = {
      {Rigid<World, World>(Eigen::Isometry3d(Eigen::Translation3d(ahead))), PointList{{0, 0, 0}},
       0.1f}};
  const Image image = masked(lens, avoided, T_world_projector.inverse());
  EXPECT_TRUE(isDark(image, 320, 200));
  EXPECT_TRUE(isDark(image, 345, 200));
  EXPECT_FALSE(isDark(image, 365, 200));
}

TEST(DarkMask, refusesAnImageOfAnotherSize) {
  DarkMask mask(test::lens(640, 400, 640, 320, 200));
  Image image{320, 200, std::vector<std::uint8_t>(3 * 320 * 200)};
  EXPECT_THROW(mask.apply(image), std::logic_error);
}

// ---------------------------------------------------------------------------------------- standing

/// A floor of 4 m x 4 m and a table of 1 m x 1 m, 0.7 m high.
std::vector<SurfacePatch> floorAndTable() {
  Eigen::Isometry3d T_world_table = Eigen::Isometry3d::Identity();
  T_world_table.translation() << 1, 0, 0.7;
  return {{"floor", {}, {{-2, -2}, {2, -2}, {2, 2}, {-2, 2}}},
          {"table",
           Rigid<World, Surface>(T_world_table),
           {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}}};
}

bool stands(const Eigen::Vector3f& p, const std::vector<SurfacePatch>& surfaces) {
  return !standingPoints({p}, {}, surfaces, 0.1).empty();
}

TEST(StandingPoints, areAboveASurfaceAndLieOnNone) {
  const auto surfaces = floorAndTable();
  EXPECT_FALSE(stands({0, 0, 0.05f}, surfaces)) << "a carpet";
  EXPECT_FALSE(stands({0, 0, -0.05f}, surfaces)) << "noise";
  EXPECT_TRUE(stands({0, 0, 0.15f}, surfaces)) << "a foot";
  EXPECT_TRUE(stands({3, 3, 1}, surfaces)) << "a person beside the floor's outline";
  EXPECT_FALSE(stands({1, 0, 0.7f}, surfaces)) << "the table's top";
  EXPECT_TRUE(stands({1, 0, 0.85f}, surfaces)) << "a hand over the table";
  EXPECT_TRUE(stands({1, 0, 0.4f}, surfaces)) << "a leg under the table";
  EXPECT_TRUE(stands({0.4f, 0, 0.7f}, surfaces)) << "a hip beside the table";
  EXPECT_FALSE(stands({0, 0, -1}, surfaces)) << "below all";
  EXPECT_FALSE(stands({std::numeric_limits<float>::quiet_NaN(), 0, 1}, surfaces));
  EXPECT_TRUE(standingPoints({{0, 0, 1}}, {}, {}, 0.1).empty()) << "no surface";
}

TEST(StandingPoints, countFromTheReliefWhereItIsKnown) {
  std::vector<SurfacePatch> surfaces = {floorAndTable()[0]};
  // A step: 0.3 m high for x > 0.
  std::vector<float> heights;
  for (int i = 0; i < 41 * 41; ++i) heights.push_back(i % 41 > 20 ? 0.3f : 0);
  surfaces[0].relief =
      std::make_shared<const Relief>(Eigen::Vector2d(-2, -2), 0.1, 41, 41, heights);
  EXPECT_FALSE(stands({1, 0, 0.35f}, surfaces));
  EXPECT_TRUE(stands({1, 0, 0.45f}, surfaces));
  EXPECT_TRUE(stands({-1, 0, 0.35f}, surfaces));
}

TEST(ForeignPoints, areNotMeasuredOnTheRobotNorLeftOutBeyondItsPadding) {
  const AvoidedPoints link{Rigid<World, World>(Eigen::Isometry3d(Eigen::Translation3d(1, 0, 0))),
                           surfacePoints(Cube{{0.4f, 0.2f, 0.1f}}, 0.01), 0.05f};
  std::mt19937 random(2);
  std::uniform_real_distribution<float> share(-0.6f, 0.6f);
  Eigen::Isometry3d T_world_camera = Eigen::Isometry3d::Identity();
  T_world_camera.translation() << 0, 0, 1;
  PointList points;
  std::vector<float> away;
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3f p(share(random) / 2, share(random) / 3,
                            share(random) / 4);  // on the link
    const Eigen::Array3f beyond = p.array().abs() - Eigen::Array3f(0.2f, 0.1f, 0.05f);
    away.push_back(beyond.max(0).matrix().norm() + std::min(beyond.maxCoeff(), 0.f));
    points.push_back(p + Eigen::Vector3f(1, 0, -1));  // in the camera
  }
  const PointList foreign = foreignPoints(points, Rigid<World, World>(T_world_camera), {link});
  std::size_t next = 0, left_out = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool is_foreign = next < foreign.size() && foreign[next] == points[i];
    if (is_foreign) ++next;
    if (!is_foreign) ++left_out;
    if (std::abs(away[i]) < 0.008f) {
      EXPECT_FALSE(is_foreign) << away[i];
    } else if (std::abs(away[i]) > 0.05f) {
      EXPECT_TRUE(is_foreign) << away[i];
    }
  }
  EXPECT_EQ(next, foreign.size());
  EXPECT_GT(left_out, 300u);
  EXPECT_EQ(foreignPoints(points, {}, {}).size(), points.size());
  const AvoidedPoints unpadded{{}, PointList{{0, 0, 0}}, 0};
  EXPECT_EQ(foreignPoints(points, {}, {unpadded}).size(), points.size());
  const AvoidedPoints endless{{}, PointList{{0, 0, 0}, {1e5f, 1e5f, 1e5f}}, 0.05f};
  EXPECT_EQ(foreignPoints(points, {}, {endless}).size(), points.size());
}

TEST(StandingColumns, riseFromTheSurfaceBelow) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0, 0, 0.3;  // a laser, level
  const PointList columns =
      standingColumns({{1, 1, 0}}, Rigid<World, World>(T), {floorAndTable()[0]}, 2, 0.1);
  ASSERT_EQ(columns.size(), 21u);
  for (const Eigen::Vector3f& p : columns)
    EXPECT_NEAR((p.head<2>() - Eigen::Vector2f(1, 1)).norm(), 0, 1e-6);
  EXPECT_NEAR(columns.front().z(), 0, 1e-6);
  EXPECT_NEAR(columns.back().z(), 2, 1e-5);
  EXPECT_TRUE(standingColumns({{1, 1, -1}}, {}, floorAndTable(), 2, 0.1).empty());
}

// ---------------------------------------------------------------------------------------- surfaces

TEST(SurfacePoints, leaveNoGapOnASolid) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> share(-0.5f, 0.5f);
  const auto expectNear = [](const PointList& points, const Eigen::Vector3f& p, float most) {
    float least = 1e9f;
    for (const Eigen::Vector3f& q : points) least = std::min(least, (p - q).norm());
    ASSERT_LE(least, most) << p.transpose();
  };
  const PointList box = surfacePoints(Cube{{0.4f, 0.2f, 0.03f}}, 0.02);
  const PointList can = surfacePoints(Cylinder{{0.1f, 0.1f, 0.3f}}, 0.02);
  const PointList ball = surfacePoints(Sphere{{0.2f, 0.2f, 0.2f}}, 0.02);
  for (int i = 0; i < 200; ++i) {
    const float a = share(random), b = share(random), turn = 6.2831853f * a;
    expectNear(box, {0.4f * a, 0.2f * b, 0.015f}, 0.02f);
    expectNear(box, {0.2f, 0.2f * a, 0.03f * b}, 0.02f);
    expectNear(can, {0.05f * std::cos(turn), 0.05f * std::sin(turn), 0.3f * b}, 0.02f);
    const Eigen::Vector3f up(std::cos(turn), std::sin(turn), 2 * b);
    expectNear(ball, 0.1f * up.normalized(), 0.02f);
  }
  for (const Eigen::Vector3f& p : ball) EXPECT_NEAR(p.norm(), 0.1f, 0.002f);
  EXPECT_LT(box.size(), 3000u);
}

TEST(SurfacePoints, areOfMeshesAndRefuseWhatIsNoSolid) {
  auto body = std::make_shared<Body>();
  body->points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  body->triangles = {{0, 1, 2}};
  const PointList points = surfacePoints(MeshInstance{body, {0.1f, 0.1f, 0.1f}}, 0.01);
  EXPECT_GT(points.size(), 60u);
  for (const Eigen::Vector3f& p : points) EXPECT_LE(p.x() + p.y(), 0.1001f);
  EXPECT_THROW(surfacePoints(Arrow(), 0.01), std::invalid_argument);
  EXPECT_THROW(surfacePoints(Cube{{100, 100, 100}}, 0.01), std::runtime_error);  // millimeters
  const float kInf = std::numeric_limits<float>::infinity();
  EXPECT_THROW(surfacePoints(Cube{{kInf, 1, 1}}, 0.01), std::runtime_error);
}

}  // namespace
}  // namespace afterglow::render::dark_mask_test

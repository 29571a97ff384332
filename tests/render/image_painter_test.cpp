// Images drawn by the CPU, without any GL: where things land, what they cover, what hides what.
#include "render/paint/image_painter.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <random>
#include <stdexcept>
#include <thread>

#include "render/paint/point_projector.hpp"
#include "render/paint/polygon_coverage.hpp"
#include "tests/support/optics.hpp"

namespace afterglow::render::image_painter_test {
namespace {

constexpr int kWidth = 96, kHeight = 80;

ScreenPoint pointAt(double u, double v, std::uint32_t color, std::uint32_t order = 0) {
  ScreenPoint point;
  point.u = static_cast<std::int32_t>(std::lround(u * kSubpixels));
  point.v = static_cast<std::int32_t>(std::lround(v * kSubpixels));
  point.order = order;
  point.color = color;
  return point;
}

class ImagePainterTest : public ::testing::Test {
 protected:
  /// One run of all points.
  void paint(const std::vector<ScreenPoint>& points, float size_px, bool is_ordered = true) {
    PointRun run;
    run.count = static_cast<std::uint32_t>(points.size());
    run.size_px = size_px;
    run.is_ordered = is_ordered;
    paint(points, {run});
  }
  void paint(const std::vector<ScreenPoint>& points, const std::vector<PointRun>& runs) {
    PaintList list;
    list.screen_points = points;
    list.runs = runs;
    list.layers.resize(1);
    for (std::uint32_t i = 0; i < runs.size(); ++i) {
      list.layers[0].pieces.push_back({Piece::Kind::Points, false, i, 1, 0});
    }
    paint(list);
  }
  /// One run of opaque triangles.
  void paint(const std::vector<LightVertex>& vertices, const std::vector<std::uint32_t>& indices) {
    PaintList list;
    list.steps.triangles.vertices = vertices;
    list.steps.triangles.indices = indices;
    list.layers.resize(1);
    list.layers[0].pieces.push_back(
        {Piece::Kind::Triangles, true, 0, static_cast<std::uint32_t>(indices.size()), 0});
    paint(list);
  }
  void paint(PaintList& list) {
    rgb_.assign(3 * kWidth * kHeight, 77);
    painter_.project(list);
    painter_.paint(list, painter_.allBands(), rgb_.data());
  }
  int red(int u, int v) const { return rgb_[static_cast<std::size_t>(3 * (v * kWidth + u))]; }
  int green(int u, int v) const { return rgb_[static_cast<std::size_t>(3 * (v * kWidth + u) + 1)]; }
  /// Lit area in pixels, and its center.
  Eigen::Vector3d redAreaAndCenter() const {
    Eigen::Vector3d sums = Eigen::Vector3d::Zero();
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) sums += red(u, v) / 255.0 * Eigen::Vector3d(1, u, v);
    }
    return {sums[0], sums[1] / sums[0], sums[2] / sums[0]};
  }

  Workers workers_;
  ImagePainter painter_{test::lens(kWidth, kHeight, 100, 48, 40), workers_};
  std::vector<std::uint8_t> rgb_;
};

TEST_F(ImagePainterTest, givesEachPixelTheShareThatIsCovered) {
  for (const float size : {0.5f, 1.f, 2.5f, 3.f, 24.f}) {
    // The second lies on the border between two bands.
    for (const Eigen::Vector2d& at : {Eigen::Vector2d(40.3, 20.71), {33.125, 31.6}}) {
      paint({pointAt(at.x(), at.y(), 0xffffffff)}, size);
      const Eigen::Vector3d found = redAreaAndCenter();
      EXPECT_NEAR(found[0], static_cast<double>(size * size), 0.02 * std::max(1.f, size)) << size;
      if (size != std::round(size)) continue;  // the pixels' raster keeps no other centers
      EXPECT_NEAR(found[1], at.x(), 0.01) << size;
      EXPECT_NEAR(found[2], at.y(), 0.01) << size;
    }
  }
}

TEST_F(ImagePainterTest, isBlackWhereNothingIsAndCutsAtTheBorder) {
  paint({}, 3);
  EXPECT_EQ(*std::max_element(rgb_.begin(), rgb_.end()), 0);
  paint({pointAt(0, 0, 0xffffffff), pointAt(kWidth - 1, kHeight - 1, 0xffffffff),
         pointAt(-100, 5, 0xffffffff), pointAt(5, -100, 0xffffffff), pointAt(5, 200, 0xffffffff),
         pointAt(220, 5, 0xffffffff)},
        3);
  EXPECT_NEAR(redAreaAndCenter()[0], 8, 0.01);
}

TEST_F(ImagePainterTest, paintsTheFarthestFirstAndMixesAtTheRim) {
  const std::uint32_t kRed = 0xff0000ff, kGreen = 0xff00ff00;
  paint({pointAt(10.5, 10, kGreen, 2), pointAt(10, 10, kRed, 1)}, 3);
  EXPECT_EQ(red(10, 10), 0);
  EXPECT_EQ(green(10, 10), 255);
  EXPECT_NEAR(red(9, 10), 128, 1);  // half of it is covered by what is nearer
  EXPECT_NEAR(green(9, 10), 128, 1);
  paint({pointAt(10, 10, 0x400000ff, 1), pointAt(10, 10, 0x4000ff00, 2)}, 1);
  EXPECT_NEAR(red(10, 10), 64 * 0.75, 1);  // alpha 64 of 255, under as much green
  EXPECT_NEAR(green(10, 10), 64, 1);
}

TEST_F(ImagePainterTest, keepsRunsApart) {
  PointRun first, second;
  first.count = second.count = second.first = 1;
  first.size_px = second.size_px = 3;
  first.is_ordered = second.is_ordered = true;
  // The second run lies over the first although its point is farther.
  paint({pointAt(10, 10, 0xff0000ff, 9), pointAt(10, 10, 0xff00ff00, 1)}, {first, second});
  EXPECT_EQ(red(10, 10), 0);
  EXPECT_EQ(green(10, 10), 255);
}

constexpr int kSides = 24;
constexpr double kRadius = 20;  ///< px

/// A fan around its first vertex, which is in the middle of a ring or on it.
std::vector<std::uint32_t> fanOf(std::uint32_t first, std::uint32_t count) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t k = 1; k + 1 < count; ++k) {
    for (const std::uint32_t i : {0u, k, k + 1}) indices.push_back(first + i);
  }
  return indices;
}

/// At pixel coordinates of the fixture's lens.
LightVertex vertexAt(double u, double v, double depth, const Rgba& color) {
  return {static_cast<float>((u - 48) / 100), static_cast<float>((v - 40) / 100), 1,
          static_cast<float>(depth), color};
}

/// Corners of a regular polygon; what is farther right is `slope` a pixel deeper.
void addRing(double u, double v, double depth, double slope, const Rgba& color,
             std::vector<LightVertex>& out) {
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * M_PI * i / kSides, x = kRadius * std::cos(angle);
    out.push_back(vertexAt(u + x, v + kRadius * std::sin(angle), depth + slope * x, color));
  }
}

const Rgba kOpaqueRed = {255, 0, 0, 255}, kOpaqueGreen = {0, 255, 0, 255};

TEST_F(ImagePainterTest, lightsAFlatFanAsMuchAsItsTriangles) {
  std::vector<LightVertex> disc;
  addRing(40.3, 33.7, 0.5, 1e-3, kOpaqueRed, disc);
  paint(disc, fanOf(0, kSides));
  const double area = 0.5 * kSides * kRadius * kRadius * std::sin(2 * M_PI / kSides);
  EXPECT_NEAR(redAreaAndCenter()[0], area, 1e-3 * area);
  EXPECT_NEAR(redAreaAndCenter()[1], 40.3, 0.01);
  EXPECT_NEAR(redAreaAndCenter()[2], 33.7, 0.01);
}

TEST_F(ImagePainterTest, lightsSmallTrianglesByTheirArea) {
  std::mt19937 random(3);
  // At bands' borders and in the middle, some too wide for what is small, some over the left side.
  std::uniform_real_distribution<double> u(-1, 9), v(-5, 5);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector2d middle(i % 5 == 0 ? 0 : 40, i % 2 == 0 ? 31.5 : 56);
    std::array<Eigen::Vector2d, 3> corners;
    std::vector<LightVertex> vertices;
    for (Eigen::Vector2d& corner : corners) {
      corner = middle + Eigen::Vector2d(u(random), v(random));
      vertices.push_back(vertexAt(corner.x(), corner.y(), 0.5, kOpaqueRed));
    }
    if (std::any_of(corners.begin(), corners.end(), [](const auto& c) { return c.x() < -0.5; })) {
      continue;  // not all of it is seen
    }
    paint(vertices, {0, 1, 2});
    const Eigen::Vector2d b = corners[1] - corners[0], c = corners[2] - corners[0];
    const double area = std::abs(b.x() * c.y() - b.y() * c.x()) / 2;
    EXPECT_NEAR(redAreaAndCenter()[0], area, 0.03 + 0.003 * area);
    if (area < 3) continue;
    // Within a pixel the raster keeps no center.
    const Eigen::Vector2d center = (corners[0] + corners[1] + corners[2]) / 3;
    EXPECT_NEAR(redAreaAndCenter()[1], center.x(), 0.2);
    EXPECT_NEAR(redAreaAndCenter()[2], center.y(), 0.2);
  }
}

TEST_F(ImagePainterTest, cutsTwoFlatFansWhereTheyMeet) {
  std::vector<LightVertex> discs;
  addRing(48, 40, 0.5, 1e-3, kOpaqueRed, discs);
  addRing(48, 40, 0.5, -1e-3, kOpaqueGreen, discs);
  std::vector<std::uint32_t> indices = fanOf(0, kSides);
  for (const std::uint32_t i : fanOf(kSides, kSides)) indices.push_back(i);
  paint(discs, indices);
  EXPECT_EQ(red(40, 40), 255);
  EXPECT_EQ(green(40, 40), 0);
  EXPECT_EQ(red(56, 40), 0);
  EXPECT_EQ(green(56, 40), 255);
}

TEST_F(ImagePainterTest, letsATipThroughWhatHidesTheRestOfItsFan) {
  const std::uint32_t first_of_disc = kSides + 2;
  std::vector<LightVertex> cone_and_disc = {vertexAt(48, 40, 0.1, kOpaqueRed)};
  addRing(48, 40, 0.9, 0, kOpaqueRed, cone_and_disc);
  cone_and_disc.push_back(cone_and_disc[1]);
  addRing(48, 40, 0.5, 0, kOpaqueGreen, cone_and_disc);
  std::vector<std::uint32_t> indices = fanOf(0, first_of_disc);
  for (const std::uint32_t i : fanOf(first_of_disc, kSides)) indices.push_back(i);
  paint(cone_and_disc, indices);
  EXPECT_NEAR(red(48, 40), 255, 5);
  EXPECT_EQ(red(52, 42), 255);
  EXPECT_EQ(red(62, 44), 0);
  EXPECT_EQ(green(62, 44), 255);
}

TEST(PolygonCoverage, givesEveryPixelItsExactShare) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> x(-20, kWidth + 20.f), y(-10, 30);
  PolygonCoverage coverage(kWidth);
  for (int i = 0; i < 200; ++i) {
    const Corner corners[3] = {
        {x(random), y(random)}, {x(random), y(random)}, {x(random), y(random)}};
    std::vector<double> shares(kWidth * kBandRows, 0);
    coverage.visit(corners, 3, PolygonCoverage::Outline::Polygon, 0, kBandRows,
                   [&](int row, int begin, int count, const float* found) {
                     for (int k = 0; k < count; ++k) {
                       shares[static_cast<std::size_t>(row * kWidth + begin + k)] =
                           std::abs(static_cast<double>(found[k]));
                     }
                   });
    const auto side = [&](std::size_t k, double px, double py) {
      const Corner &a = corners[k], &b = corners[(k + 1) % 3];
      return (static_cast<double>(b.x) - a.x) * (py - a.y) -
             (static_cast<double>(b.y) - a.y) * (px - a.x);
    };
    double worst = 0;
    constexpr int kSamples = 8;
    for (int row = 0; row < kBandRows; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        int inside = 0;
        for (int s = 0; s < kSamples * kSamples; ++s) {
          const double px = column + (s % kSamples + 0.5) / kSamples;
          const double py = row + (s / kSamples + 0.5) / kSamples;
          const bool a = side(0, px, py) > 0, b = side(1, px, py) > 0, c = side(2, px, py) > 0;
          inside += a == b && b == c;
        }
        const double share = static_cast<double>(inside) / (kSamples * kSamples);
        worst = std::max(worst,
                         std::abs(share - shares[static_cast<std::size_t>(row * kWidth + column)]));
      }
    }
    EXPECT_LT(worst, 0.13) << "what 64 samples can tell";
  }
}

TEST(PolygonBrush, givesSmallOutlinesTheSameSharesWithAnyVectors) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> x(4, kWidth - 5.f), y(-2, kBandRows + 2.f), angle(0, 6.28f),
      size(0.1f, 3.9f);
  PolygonCoverage coverage(kWidth);
  for (std::uint32_t i = 0; i < 600; ++i) {
    Sprite sprite;
    sprite.count = 3 + i % 16;
    sprite.color = 0xffffffff;
    std::vector<float> angles(sprite.count);
    for (float& at : angles) at = angle(random);
    std::sort(angles.begin(), angles.end());
    // Some have upright and level edges.
    if (sprite.count == 4 && i % 3 == 0) angles = {0.5f, 2.64159f, 3.64159f, 5.78319f};
    const Corner center{x(random), y(random)};
    const float radius = size(random);
    std::vector<Corner> corners;
    for (const float at : angles) {
      corners.push_back({center.x + radius * std::cos(at), center.y + radius * std::sin(at)});
    }
    std::vector<double> levels(kWidth * kBandRows, 0);
    coverage.visit(corners.data(), corners.size(), PolygonCoverage::Outline::Polygon, 0, kBandRows,
                   [&](int row, int begin, int count, const float* shares) {
                     for (int k = 0; k < count; ++k) {
                       levels[static_cast<std::size_t>(row * kWidth + begin + k)] =
                           255 * std::abs(static_cast<double>(shares[k]));
                     }
                   });
    corners.push_back(corners[0]);
    corners.resize(sprite.count + kCornersMore);
    for (const bool are_eight : {false, hasAvx2()}) {
      PolygonBrush brush(kWidth, are_eight);
      Canvas canvas(kWidth);
      brush.paint(sprite, corners.data(), 0, kBandRows, nullptr, canvas);
      double worst = 0;
      for (int row = 0; row < kBandRows; ++row) {
        const Light* lights = canvas.finish(row);
        for (int column = 0; column < kWidth; ++column) {
          worst =
              std::max(worst, std::abs(lights[column][0] -
                                       levels[static_cast<std::size_t>(row * kWidth + column)]));
        }
      }
      EXPECT_LT(worst, 1.01) << "share and light are rounded each";
    }
  }
}

TEST(PolygonCoverage, leavesOutWhatNoIntegerHolds) {
  PolygonCoverage coverage(kWidth);
  const float nan = std::nanf("");
  for (const Corner& odd :
       {Corner{nan, 5}, {5, nan}, {INFINITY, 5}, {5, -INFINITY}, {1e30f, 1e30f}}) {
    const Corner corners[3] = {{1, 1}, odd, {8, 20}};
    coverage.visit(corners, 3, PolygonCoverage::Outline::Polygon, 0, kBandRows,
                   [](int, int, int, const float*) { FAIL(); });
  }
}

TEST(PointOrder, sortsByAllBitsAndKeepsEqualsInOrder) {
  std::mt19937 random(3);
  std::vector<ScreenPoint> points, room;
  for (int i = 0; i < 5000; ++i) {
    points.push_back(pointAt(i, 0, 0, i % 3 == 0 ? random() : random() % 64));
  }
  std::vector<ScreenPoint> expected = points;
  std::stable_sort(expected.begin(), expected.end(),
                   [](const auto& a, const auto& b) { return a.order < b.order; });
  const ScreenPoint* sorted = sortByOrder(points.data(), points.size(), room);
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_EQ(sorted[i].u, expected[i].u) << i;
}

TEST(Workers, hasAllOfAJobDoneAndPassesFailuresOn) {
  for (const int count : {1, 2, 5}) {
    Workers workers(count);
    ASSERT_EQ(workers.count(), count);
    for (int i = 0; i < 200; ++i) {
      std::vector<int> done(static_cast<std::size_t>(count));
      workers.run([&](int worker) { ++done[static_cast<std::size_t>(worker)]; });
      EXPECT_EQ(done, std::vector<int>(static_cast<std::size_t>(count), 1));
    }
    for (int failing = 0; failing < count; ++failing) {
      EXPECT_THROW(workers.run([&](int worker) {
        if (worker == failing) throw std::runtime_error("no memory");
      }),
                   std::runtime_error);
    }
  }
}

TEST(Workers, shareEveryItemOnceAndLeaveFewToOne) {
  Workers workers(3);
  for (const std::size_t items : {0u, 5u, 10'000u, 10'001u}) {
    std::vector<int> done(items);
    std::atomic<int> parts{0};
    workers.share(items, [&](int, std::size_t begin, std::size_t end) {
      ++parts;
      for (std::size_t i = begin; i < end; ++i) ++done[i];
    });
    EXPECT_EQ(std::count(done.begin(), done.end(), 1), static_cast<std::ptrdiff_t>(items));
    EXPECT_EQ(parts, workers.sharers(items));
    EXPECT_EQ(parts, items < 100 ? 1 : 3);
  }
}

TEST(Workers, areAsManyAsTheMachineHasProcessorsAndNotTooMany) {
  EXPECT_GE(Workers::usualCount(), 1);
  EXPECT_LE(Workers::usualCount(), Workers::kMost);
  EXPECT_LE(Workers::usualCount(), std::max(1u, std::thread::hardware_concurrency()));
  cpu_set_t all, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof(all), &all), 0);
  CPU_ZERO(&one);
  for (int i = 0; CPU_COUNT(&one) == 0; ++i) {
    if (CPU_ISSET(i, &all)) CPU_SET(i, &one);
  }
  ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
  EXPECT_EQ(Workers::usualCount(), 1);
  ASSERT_EQ(sched_setaffinity(0, sizeof(all), &all), 0);
}

// ---------------------------------------------------------------------------------- projection
struct Projected {
  PointRun run;
  std::vector<ScreenPoint> points;
};

Projected project(const calib::Lens& lens, const PointCloud& cloud,
                  const PointPlacement& placement = {}, const Color& color = {}) {
  Workers workers;
  Projected result;
  std::size_t used = 0;
  result.run = PointProjector(lens).project(cloud, color, placement, workers, result.points, used);
  EXPECT_EQ(used, result.run.count);
  result.points.resize(used);
  return result;
}

PointCloud cloudOf(const std::vector<Eigen::Vector3f>& points) {
  PointCloud cloud;
  cloud.style = PointStyle::Points;
  cloud.size = 3;
  cloud.points = points;
  return cloud;
}

TEST(PointProjector, landsWhereOpenCvSaysThroughEveryLensAndFarFromTheOrigin) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(0, 1280), v(0, 800), distance(0.5, 4);
  for (const std::vector<double>& D : {std::vector<double>{},
                                       {-0.35, 0.12, 0.002, -0.0015, -0.03},
                                       {-0.3, 0.1, 1e-3, -2e-3, 0.01, 0.02, 0.03, 0.01}}) {
    const calib::Lens lens = test::lens(1280, 800, 900, 640, 817, D);
    // The room's origin is a few hundred meters away.
    Eigen::Isometry3d T_cloud_optical = Eigen::Isometry3d::Identity();
    T_cloud_optical.linear() = test::randomRotation(random);
    T_cloud_optical.translation() << 200, -100, 3;
    PointPlacement placement;
    placement.P_optical_cloud = T_cloud_optical.inverse().matrix();
    std::vector<Eigen::Vector3f> points;
    std::vector<Eigen::Vector3d> optical;
    for (int i = 0; i < 1000; ++i) {
      const auto ray = calib::unproject(lens, {u(random), v(random)});
      if (!ray) continue;
      points.push_back((T_cloud_optical * (*ray * distance(random))).cast<float>());
      optical.push_back(T_cloud_optical.inverse() * points.back().cast<double>());
    }
    const auto pixels = test::projectWithOpenCv(lens, optical);
    const Projected found = project(lens, cloudOf(points), placement);
    ASSERT_EQ(found.points.size(), points.size());
    double worst = 0;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Eigen::Vector2d pixel(found.points[i].u / 256.0, found.points[i].v / 256.0);
      worst = std::max(worst, (pixel - pixels[i]).norm());
    }
    EXPECT_LT(worst, 0.02);  // half a subpixel's diagonal is 0.003
  }
}

TEST(PointProjector, dropsWhatNoLensShows) {
  const float nan = std::nanf("");
  const calib::Lens folding = test::lens(1280, 800, 900, 640, 400, {-0.35, 0, 0, 0, 0});
  ASSERT_LT(folding.fold_radius, 1.1);
  const Projected found = project(folding, cloudOf({{nan, 0, 1},
                                                    {0, 0, 1},
                                                    {0, 0, -1},
                                                    {0, 0, 0.01f},
                                                    {0, INFINITY, 1},
                                                    {1.6f, 0, 1},
                                                    {0, 0, 0},
                                                    {1e6f, 1e6f, 1},
                                                    {1e-30f, 0, 1},
                                                    {0.1f, 0, 1}}));
  EXPECT_EQ(found.run.count, 3u);
  EXPECT_EQ(project(folding, cloudOf({{nan, 0, 1}})).run.count, 0u);
  EXPECT_EQ(project(folding, cloudOf({})).run.count, 0u);
  EXPECT_EQ(project(folding, cloudOf({{0, 0, 1}}), {}, {1, 1, 1, 0}).run.count, 0u);  // invisible
}

TEST(PointProjector, ordersByDistanceOrHeightOnlyWhereItShows) {
  PointCloud cloud = cloudOf({{0, 0, 1}, {0, 0, 3}, {0, 0, 2}});
  const calib::Lens lens = test::viewsonic();
  Projected found = project(lens, cloud);
  EXPECT_FALSE(found.run.is_ordered);
  EXPECT_LT(found.points[1].order, found.points[2].order);
  EXPECT_LT(found.points[2].order, found.points[0].order);
  PointPlacement draped;
  draped.flattened = true;
  draped.height << 0, 0, 1, -2;  // one below the surface, one on it, one above
  found = project(lens, cloud, draped, {1, 0, 0, 0.5f});
  EXPECT_TRUE(found.run.is_ordered);
  EXPECT_LT(found.points[0].order, found.points[2].order);
  EXPECT_LT(found.points[2].order, found.points[1].order);
  cloud.colors = {{255, 0, 0, 255}, {0, 255, 0, 255}, {255, 0, 0, 255}};
  found = project(lens, cloud);
  EXPECT_TRUE(found.run.is_ordered);
  EXPECT_EQ(found.points[1].color, 0xff00ff00u);
}

}  // namespace
}  // namespace afterglow::render::image_painter_test

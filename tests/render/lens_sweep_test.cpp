// What is drawn through lenses of every kind, before any GL: points where OpenCV puts them, long
// lines where the exact lens bends them, nothing from beyond the fold.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/paint/cpu_drawer.hpp"
#include "tests/support/optics.hpp"
#include "tests/support/seen_triangles.hpp"

namespace afterglow::render::lens_sweep_test {
namespace {

struct SweepLens {
  std::string name;
  calib::Lens lens;
};
void PrintTo(const SweepLens& one, std::ostream* out) { *out << one.name; }

std::vector<SweepLens> sweep() {
  std::vector<SweepLens> all;
  const auto add = [&](const std::string& name, double f, double cx, double cy,
                       const std::vector<double>& D) {
    all.push_back({name, test::lens(1280, 800, f, cx, cy, D)});
  };
  for (int k1 = 20; k1 >= -35; k1 -= 5) {
    add("k1 " + std::to_string(k1) + "/100", 900, 640, 400, {k1 / 100.0, 0, 0, 0, 0});
  }
  add("k1 and k2", 900, 640, 400, {-0.35, 0.12, 0, 0, -0.03});
  add("tangential", 1100, 630, 410, {-0.1, 0.02, 0.004, -0.003, 0});
  add("rational", 900, 640, 400, {-0.3, 0.1, 1e-3, -2e-3, 0.01, 0.02, 0.03, 0.01});
  add("shifted down", 1900, 640, 817, {-0.35, 0.12, 0.002, -0.0015, -0.03});
  add("shifted out of the corner", 1500, -150, 1000, {-0.2, 0.05, 1e-3, 1e-3, 0});
  const auto fisheye = [&](const std::string& name, double f, double cx, double cy,
                           const std::vector<double>& k) {
    all.push_back({"equidistant " + name, test::fisheye(1280, 800, f, cx, cy, k)});
  };
  fisheye("narrow", 1200, 640, 817, {0.02, -0.01, 0.004, -0.001});
  fisheye("wide", 600, 640, 400, {-0.03, 0.01, -0.004, 0.0005});
  fisheye("of 180 degrees", 400, 600, 420, {0, 0, 0, 0});
  fisheye("that folds", 500, 640, 400, {-0.2, 0, 0, 0});
  return all;
}

class EveryLens : public ::testing::TestWithParam<SweepLens> {
 protected:
  const calib::Lens& lens() const { return GetParam().lens; }

  /// A point seen at this pixel.
  std::optional<Eigen::Vector3d> pointAt(double u, double v, double z) const {
    const auto ray = calib::unproject(lens(), {u, v});
    return ray ? std::optional<Eigen::Vector3d>(*ray * z) : std::nullopt;
  }

  /// The pixel, or as near to it from the image's middle as the lens shows anything.
  Eigen::Vector2d reach(const Eigen::Vector2d& wanted) const {
    const Eigen::Vector2d middle(lens().width / 2.0, lens().height / 2.0);
    Eigen::Vector2d pixel = wanted;
    while (!calib::unproject(lens(), middle + 1.05 * (pixel - middle))) {
      pixel = middle + 0.97 * (pixel - middle);
    }
    return pixel;
  }
};

Scene inFront(Shape shape) {
  Layer layer;
  layer.drawables.push_back({{}, std::move(shape), {}});
  return {{layer}, {}};
}

TEST_P(EveryLens, putsPointsWhereOpenCvDoes) {
  std::vector<Eigen::Vector3d> points;
  for (int v = 0; v <= 800; v += 25) {
    for (int u = 0; u <= 1280; u += 20) {
      if (const auto p = pointAt(u, v, 0.5 + 0.001 * u)) points.push_back(*p);
    }
  }
  ASSERT_GT(points.size(), 1000u);
  const auto expected = test::projectWithOpenCv(lens(), points);
  const FloatLens floats(lens());
  double worst = 0, worst_float = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto pixel = calib::project(lens(), points[i]);
    ASSERT_TRUE(pixel);
    worst = std::max(worst, (*pixel - expected[i]).norm());
    const Eigen::Vector2f n = points[i].hnormalized().cast<float>();
    const Corner seen = floats.seen(n.x(), n.y());
    const Eigen::Vector2d seen_pixel(double(seen.x) - 0.5, double(seen.y) - 0.5);
    worst_float = std::max(worst_float, (seen_pixel - expected[i]).norm());
  }
  std::printf("%s: %zu points, %.1e px off, %.1e px in floats\n", GetParam().name.c_str(),
              points.size(), worst, worst_float);
  EXPECT_LT(worst, 1e-7);
  EXPECT_LT(worst_float, 0.005);  // 0.05 are promised
}

/// A straight edge in space.
struct Edge {
  Eigen::Vector3d from, to;

  /// Where its image crosses a column (across = 0) or row (1).
  double crossing(const calib::Lens& lens, int across, double at) const {
    double low = 0, high = 1;
    const bool grows = (*calib::project(lens, to))[across] > (*calib::project(lens, from))[across];
    for (int i = 0; i < 40; ++i) {
      const double t = 0.5 * (low + high);
      const double here = (*calib::project(lens, from + t * (to - from)))[across];
      ((here < at) == grows ? low : high) = t;
    }
    return (*calib::project(lens, from + low * (to - from)))[1 - across];
  }
  /// Of that image from a place in the column or row, px.
  double distance(const calib::Lens& lens, int across, double at, double place) const {
    const double slope = crossing(lens, across, at + 0.5) - crossing(lens, across, at - 0.5);
    return std::abs(place - crossing(lens, across, at)) / std::hypot(1, slope);
  }
};

Eigen::Vector3d exactly(const Eigen::Vector3d& p) { return p.cast<float>().cast<double>(); }

/// Triangles as rasterizers see them: straight edges between projected vertices.
class Rasterized {
 public:
  Rasterized(const calib::Lens& lens, const LightTriangles& triangles)
      : indices_(triangles.indices) {
    for (const LightVertex& v : triangles.vertices) {
      pixels_.push_back(*calib::project(lens, Eigen::Vector3f(v.x, v.y, v.z).cast<double>()));
    }
  }

  /// What of a column or row they cover: first and last place, and the length altogether.
  struct Covered {
    double first = 1e9, last = -1e9, length = 0;
  };
  Covered covered(int across, double at) const {
    Covered result;
    for (std::size_t i = 0; i < indices_.size(); i += 3) {
      double low = 1e9, high = -1e9;
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector2d& a = pixels_[indices_[i + k]];
        const Eigen::Vector2d& b = pixels_[indices_[i + (k + 1) % 3]];
        if ((a[across] < at) == (b[across] < at)) continue;
        const double t = (at - a[across]) / (b[across] - a[across]);
        const double place = a[1 - across] + t * (b[1 - across] - a[1 - across]);
        low = std::min(low, place);
        high = std::max(high, place);
      }
      if (!(low < high)) continue;
      result.first = std::min(result.first, low);
      result.last = std::max(result.last, high);
      result.length += high - low;
    }
    return result;
  }

 private:
  const std::vector<std::uint32_t>& indices_;
  std::vector<Eigen::Vector2d> pixels_;
};

TEST_P(EveryLens, bendsLongEdgesAsTheExactLensDoes) {
  calib::Lens unclipped = lens();  // float vertices of the rim may lie a hair beyond
  unclipped.fold_radius = std::numeric_limits<double>::infinity();
  double worst = 0, worst_gap = 0;
  int places = 0;
  for (const auto& [from, to] :
       std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>{{{3, 20}, {1276, 60}},
                                                                {{3, 700}, {1276, 90}},
                                                                {{3, 400}, {1276, 420}},
                                                                {{60, 3}, {20, 796}},
                                                                {{300, 3}, {1200, 796}}}) {
    const int across = std::abs(to.x() - from.x()) > std::abs(to.y() - from.y()) ? 0 : 1;
    const Eigen::Vector2d begin = reach(from), end = reach(to);
    // A band from near to far, beside the plane of two rays.
    const Eigen::Vector3d a = *pointAt(begin.x(), begin.y(), 0.8),
                          b = *pointAt(end.x(), end.y(), 2);
    const Eigen::Vector3d aside = 0.01 * a.cross(b).normalized();
    const Eigen::Vector3d c = a + a.norm() * aside, d = b + b.norm() * aside;
    Triangles band;
    for (const auto& p : {a, b, d, a, d, c}) band.points.push_back(p.cast<float>());
    const test::SeenTriangles seen(lens(), inFront(band));
    const Rasterized raster(unclipped, seen.triangles());
    for (double at = begin[across] + 15.5; at < end[across] - 15; at += 7) {
      const auto found = raster.covered(across, at);
      Edge first{exactly(a), exactly(b)}, last{exactly(c), exactly(d)};
      if (first.crossing(unclipped, across, at) > last.crossing(unclipped, across, at)) {
        std::swap(first, last);
      }
      const double limit = across == 0 ? lens().height : lens().width;
      if (first.crossing(unclipped, across, at) < 0 ||
          last.crossing(unclipped, across, at) > limit) {
        continue;
      }
      worst = std::max({worst, first.distance(unclipped, across, at, found.first),
                        last.distance(unclipped, across, at, found.last)});
      worst_gap = std::max(worst_gap, std::abs(found.last - found.first - found.length));
      ++places;
    }
  }
  std::printf("%s: edges at %d places, %.3f px off\n", GetParam().name.c_str(), places, worst);
  EXPECT_GT(places, 300);
  EXPECT_LT(worst, 0.1);
  EXPECT_LT(worst_gap, 0.01) << "triangles overlap or leave gaps";
}

class FoldingLens : public EveryLens {};

TEST_P(FoldingLens, showsNothingFromBeyondTheFold) {
  const double fold = lens().fold_radius;
  LightComposer composer(lens());
  CpuDrawer drawer(lens());
  Image image;
  image.rgb.resize(std::size_t{3} * 1280 * 800);
  const auto isBlack = [&](const Shape& shape) {
    drawer.draw(composer.compose(inFront(shape), {}), image);
    return std::count(image.rgb.begin(), image.rgb.end(), 0) == std::ptrdiff_t(image.rgb.size());
  };
  // All around, from just outside to far out.
  for (double radius = 1.02 * fold; radius < 6 * fold; radius *= 1.3) {
    for (int i = 0; i < 8; ++i) {
      const double angle = 2 * M_PI * i / 8;
      const Eigen::Vector3d p(radius * std::cos(angle), radius * std::sin(angle), 1);
      EXPECT_FALSE(calib::project(lens(), p));
      Triangles small;
      for (const auto& q :
           {p, Eigen::Vector3d(1.01 * p), Eigen::Vector3d(p + Eigen::Vector3d(0, 0, -0.005))}) {
        small.points.push_back(q.cast<float>());
      }
      EXPECT_TRUE(test::SeenTriangles(lens(), inFront(small)).triangles().indices.empty());
      PointCloud cloud;
      cloud.style = PointStyle::Points;
      cloud.points = PointList{p.cast<float>()};
      ASSERT_TRUE(isBlack(cloud));
    }
  }
  // A wall before everything ends at the fold.
  Triangles wall;
  wall.points = {{-4e3f, -3e3f, 1}, {4e3f, -3e3f, 1}, {0, 6e3f, 1}};
  const test::SeenTriangles seen(lens(), inFront(wall));
  ASSERT_GT(seen.triangles().indices.size(), 100u);
  for (const LightVertex& v : seen.triangles().vertices) {
    EXPECT_LE(std::hypot(double(v.x), double(v.y)), fold * double(v.z) * (1 + 1e-6));
  }
  EXPECT_LT(seen.triangles().indices.size() / 3, 150'000u) << "not split without end";
}

std::vector<SweepLens> folding() {
  std::vector<SweepLens> lenses = sweep();
  const auto isPlain = [](const auto& one) { return std::isinf(one.lens.fold_radius); };
  lenses.erase(std::remove_if(lenses.begin(), lenses.end(), isPlain), lenses.end());
  return lenses;
}

std::string nameOf(const ::testing::TestParamInfo<SweepLens>& one) {
  std::string name = one.param.name;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name + "_" + std::to_string(one.index);
}

INSTANTIATE_TEST_SUITE_P(Sweep, EveryLens, ::testing::ValuesIn(sweep()), nameOf);
INSTANTIATE_TEST_SUITE_P(Sweep, FoldingLens, ::testing::ValuesIn(folding()), nameOf);

}  // namespace
}  // namespace afterglow::render::lens_sweep_test

// Every kind of shape, laid on floor and table by drape and by viewer, rendered for rigs that the
// independent referee made up and thrown back into the room by it: outlines lie where the formulas
// of projection put them, and nothing else is lit.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "tests/support/gl_context.hpp"
#include "tests/support/outlined_shapes.hpp"
#include "tests/support/referee.hpp"

namespace afterglow::render::referee_gl_test {
namespace {

using test::OutlinedShape;
using test::Points;
using Outline = std::vector<Eigen::Vector2d>;

constexpr double kWorstPixels = 0.3;  // of an outline's points
constexpr double kWorstAt = 0.0005;   // m, on a screen 1.5 m away
constexpr double kReach = 1.5;        // px around an outline that is looked at
constexpr double kPatch = 0.46, kPitch = 0.11;

Outline hullOf(const Outline& points) {
  std::vector<cv::Point2f> all, hull;
  for (const auto& p : points) all.emplace_back(1e3 * p.x(), 1e3 * p.y());  // mm
  cv::convexHull(all, hull);  // counterclockwise with y up
  Outline outline;
  for (const cv::Point2f& p : hull) outline.emplace_back(1e-3 * p.x, 1e-3 * p.y);
  double area = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % outline.size()];
    area += a.x() * b.y() - a.y() * b.x();
  }
  if (area < 0) std::reverse(outline.begin(), outline.end());
  return outline;
}

/// More than 0 inside; meters.
double depthIn(const Outline& hull, const Eigen::Vector2d& p) {
  double depth = 1e9;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d &a = hull[i], &b = hull[(i + 1) % hull.size()];
    const Eigen::Vector2d edge = (b - a).normalized(), to = p - a;
    depth = std::min(depth, edge.x() * to.y() - edge.y() * to.x());
  }
  return depth;
}

/// A point of an outline away from corners.
struct Sample {
  Eigen::Vector2d p, normal;  ///< outwards
};

std::vector<Sample> samplesOf(const Outline& hull) {
  constexpr double kTick = 0.001;
  Outline dense;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d &a = hull[i], &b = hull[(i + 1) % hull.size()];
    const int pieces = std::max(1, static_cast<int>((b - a).norm() / kTick));
    for (int j = 0; j < pieces; ++j) dense.emplace_back(a + (b - a) * (1.0 * j / pieces));
  }
  std::vector<Sample> samples;
  const std::size_t n = dense.size(), reach = 5;
  for (std::size_t i = 0; i < n; i += 4) {
    const Eigen::Vector2d before = (dense[i] - dense[(i + n - reach) % n]).normalized();
    const Eigen::Vector2d after = (dense[(i + reach) % n] - dense[i]).normalized();
    if (before.dot(after) < std::cos(0.4)) continue;
    const Eigen::Vector2d along = (before + after).normalized();
    samples.push_back({dense[i], {along.y(), -along.x()}});
  }
  return samples;
}

/// One surface with things laid on it.
struct Plane {
  test::RefereeSurface surface;
  Layer layer;
  std::vector<std::vector<Outline>> items;  ///< outlines of each one's bodies, on the surface
};

class RefereeTest : public test::GlTest {
 protected:
  void SetUp() override {
    test::GlTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    const std::string absence = test::refereeAbsence();
    if (!absence.empty()) GTEST_SKIP() << absence;
  }

  /// A patch at some height where the pixel's ray meets it.
  static test::RefereeSurface patchAt(const std::string& name, const test::Referee& referee,
                                      const Eigen::Vector2d& share, double height,
                                      const Eigen::Matrix3d& R) {
    const Eigen::Vector2d pixel =
        share.cwiseProduct(Eigen::Vector2d(referee.lens.width, referee.lens.height));
    const Eigen::Vector3d eye = referee.T_world_projector * Eigen::Vector3d::Zero();
    const Eigen::Vector3d way =
        referee.T_world_projector * *calib::unproject(referee.lens, pixel) - eye;
    test::RefereeSurface patch{name, Eigen::Isometry3d::Identity(), kPatch, kPatch};
    patch.T_world_surface.translation() = eye + way * ((height - eye.z()) / way.z());
    patch.T_world_surface.linear() = R;
    return patch;
  }

  /// Where placement puts a point: formulas of their own.
  static Eigen::Vector2d landing(const Plane& plane, const Eigen::Vector3d& p_world) {
    const Eigen::Isometry3d T = plane.surface.T_world_surface.inverse();
    const Eigen::Vector3d p = T * p_world;
    if (plane.layer.placement == Placement::Drape) return p.head<2>();
    const Eigen::Vector3d eye = T * plane.layer.p_viewer;
    return eye.head<2>() + (p - eye).head<2>() * (eye.z() / (eye.z() - p.z()));
  }

  static Plane makePlane(const test::RefereeSurface& surface, Placement placement, bool has_table) {
    Plane plane;
    plane.surface = surface;
    plane.layer.name = surface.name;
    plane.layer.placement = placement;
    plane.layer.p_viewer =
        surface.T_world_surface * Eigen::Vector3d(0.5, -1.2, has_table ? 1.0 : 1.4);
    const double side = has_table ? kPatch / 2 : 3;  // the floor is larger than its patch
    plane.layer.surface =
        SurfacePatch{surface.name,
                     Rigid<World, Surface>(surface.T_world_surface),
                     {{-side, -side}, {side, -side}, {side, side}, {-side, side}}};
    std::vector<OutlinedShape> items = test::solidShapes();
    if (placement == Placement::Drape) {
      for (OutlinedShape& item : test::flatShapes()) items.push_back(std::move(item));
    }
    for (std::size_t i = 0; i < items.size(); ++i) addItem(plane, items[i], i);
    return plane;
  }

  static void addItem(Plane& plane, const OutlinedShape& item, std::size_t index) {
    const double height = 0.05 + 0.02 * static_cast<double>(index % 4);
    const Eigen::Vector3d cell(kPitch * (static_cast<double>(index % 4) - 1.5),
                               kPitch * (static_cast<double>(index / 4) - 1.5), 0);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = cell + Eigen::Vector3d(0, 0, height);
    if (plane.layer.placement == Placement::Viewer) {
      const Eigen::Vector3d eye = plane.surface.T_world_surface.inverse() * plane.layer.p_viewer;
      T.translation() = cell + (eye - cell) * (height / eye.z());
    }
    if (!item.lies_flat) {
      T.linear() =
          (Eigen::AngleAxisd(0.7 + 0.4 * static_cast<double>(index), Eigen::Vector3d::UnitZ()) *
           Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()))
              .toRotationMatrix();
    }
    const Eigen::Isometry3d pose = plane.surface.T_world_surface * T;
    plane.layer.drawables.push_back({Rigid<World, World>(pose), item.shape, {}});
    std::vector<Outline> outlines;
    for (const Points& body : item.bodies) {
      Outline points;
      for (const Eigen::Vector3d& p : body) points.push_back(landing(plane, pose * p));
      outlines.push_back(hullOf(points));
    }
    plane.items.push_back(std::move(outlines));
  }

  static double light(const cv::Mat& top, const Eigen::Vector2d& p) {
    const double x = (p.x() + kPatch / 2) / test::Referee::kStep - 0.5;
    const double y = (kPatch / 2 - p.y()) / test::Referee::kStep - 0.5;
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    if (x0 < 0 || y0 < 0 || x0 + 1 >= top.cols || y0 + 1 >= top.rows) return 0;
    const double a = x - x0, b = y - y0;
    const auto at = [&](int row, int column) { return top.at<double>(row, column); };
    return (at(y0, x0) * (1 - a) + at(y0, x0 + 1) * a) * (1 - b) +
           (at(y0 + 1, x0) * (1 - a) + at(y0 + 1, x0 + 1) * a) * b;
  }

  /// How far outwards from a point on an outline light falls to one half.
  static double edgeOffset(const cv::Mat& top, const Sample& sample, double pixel) {
    const double tick = pixel / 50;
    double offset = -kReach * pixel;
    while (offset < kReach * pixel && light(top, sample.p + sample.normal * offset) > 0.5) {
      offset += tick;
    }
    return offset;
  }

  static Eigen::Vector2d pixelOf(const test::Referee& referee, const Plane& plane,
                                 const Eigen::Vector2d& p) {
    const Eigen::Vector3d p_world =
        plane.surface.T_world_surface * Eigen::Vector3d(p.x(), p.y(), 0);
    return *calib::project(referee.lens, referee.T_world_projector.inverse() * p_world);
  }

  /// The longer side of one, there.
  static double pixelSize(const test::Referee& referee, const Plane& plane) {
    constexpr double kStep = 0.01;
    const Eigen::Vector2d middle = pixelOf(referee, plane, {0, 0});
    return kStep / std::min((pixelOf(referee, plane, {kStep, 0}) - middle).norm(),
                            (pixelOf(referee, plane, {0, kStep}) - middle).norm());
  }

  /// Whether no corner and no other body is near, so that nothing but this edge is seen.
  static bool isFree(const Plane& plane, const Outline& outline, const Sample& sample,
                     double pixel) {
    for (const std::vector<Outline>& item : plane.items) {
      for (const Outline& other : item) {
        if (&other != &outline && depthIn(other, sample.p) > -2 * kReach * pixel) return false;
      }
    }
    return depthIn(outline, sample.p - sample.normal * kReach * pixel) > 0.95 * kReach * pixel;
  }

  static void expectOutlines(const test::Referee& referee, const Plane& plane, const cv::Mat& top) {
    double worst = 0, sum = 0;
    int count = 0;
    const double pixel = pixelSize(referee, plane);
    for (std::size_t i = 0; i < plane.items.size(); ++i) {
      double worst_of_item = 0;
      int count_of_item = 0;
      for (const Outline& outline : plane.items[i]) {
        for (const Sample& sample : samplesOf(outline)) {
          if (!isFree(plane, outline, sample, pixel)) continue;
          const double offset = edgeOffset(top, sample, pixel);
          const double pixels = (pixelOf(referee, plane, sample.p + sample.normal * offset) -
                                 pixelOf(referee, plane, sample.p))
                                    .norm();
          worst_of_item = std::max(worst_of_item, pixels);
          sum += pixels;
          ++count_of_item;
        }
      }
      EXPECT_GT(count_of_item, 5) << "item " << i;
      EXPECT_LT(worst_of_item, kWorstPixels) << "item " << i << " on the " << plane.surface.name;
      worst = std::max(worst, worst_of_item);
      count += count_of_item;
    }
    const double meters = worst * 1.5 / referee.lens.K(0, 0);
    std::printf(
        "%s, %zu things: outlines %.3f px off on average, %.3f at most (%.2f mm at 1.5 m)\n",
        plane.surface.name.c_str(), plane.items.size(), sum / count, worst, 1e3 * meters);
    EXPECT_LT(meters, kWorstAt) << "on the " << plane.surface.name;
  }

  /// Two pixels away from all outlines nothing is lit.
  static void expectDarkAround(const test::Referee& referee, const Plane& plane,
                               const cv::Mat& top) {
    const double pixel = pixelSize(referee, plane);
    int spilled = 0;
    for (int row = 2; row < top.rows; row += 5) {
      for (int column = 2; column < top.cols; column += 5) {
        const Eigen::Vector2d p((column + 0.5) * test::Referee::kStep - kPatch / 2,
                                kPatch / 2 - (row + 0.5) * test::Referee::kStep);
        if (top.at<double>(row, column) < 0.1) continue;
        const bool is_meant = std::any_of(
            plane.items.begin(), plane.items.end(), [&](const std::vector<Outline>& outlines) {
              return std::any_of(outlines.begin(), outlines.end(), [&](const Outline& outline) {
                return depthIn(outline, p) > -2 * pixel;
              });
            });
        spilled += is_meant ? 0 : 1;
      }
    }
    EXPECT_EQ(spilled, 0) << "on the " << plane.surface.name;
  }

  void expectLands(const std::string& kind, int seed, Placement placement,
                   const Eigen::Vector2d& floor_share, const Eigen::Vector2d& table_share) {
    SCOPED_TRACE(kind + " " + std::to_string(seed));
    test::Referee referee(kind, seed);
    const Eigen::Matrix3d tilted = (Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitX()))
                                       .toRotationMatrix();
    const Plane floor = makePlane(
        patchAt("floor", referee, floor_share, 0, Eigen::Matrix3d::Identity()), placement, false);
    const Plane table =
        makePlane(patchAt("table", referee, table_share, 0.35, tilted), placement, true);
    Scene scene;
    scene.layers = {floor.layer, table.layer};
    scene.surfaces = {*floor.layer.surface, *table.layer.surface};
    // What lies on the floor under the table has no light to give to the table.
    scene.layers.insert(scene.layers.begin(), floor.layer);
    for (Drawable& drawable : scene.layers[0].drawables) {
      Eigen::Isometry3d T = drawable.pose.matrix();
      T.translation().head<2>() += table.surface.T_world_surface.translation().head<2>() -
                                   floor.surface.T_world_surface.translation().head<2>();
      drawable.pose = Rigid<World, World>(T);
    }
    const Image image = ProjectorRenderer(context(), referee.lens)
                            .render(scene, referee.T_world_projector.inverse());
    const std::vector<test::RefereeSurface> room = {floor.surface, table.surface};
    std::printf("%s %d, %s: ", kind.c_str(), seed,
                placement == Placement::Drape ? "drape" : "viewer");
    for (const Plane* plane : {&floor, &table}) {
      const cv::Mat top = referee.topView(image, room, plane->surface.name);
      ASSERT_FALSE(top.empty());
      expectOutlines(referee, *plane, top);
      if (plane == &table) expectDarkAround(referee, *plane, top);
    }
  }
};

TEST_F(RefereeTest, outlinesOfAllShapesLandOnFloorAndTable) {
  expectLands("standard", 2, Placement::Drape, {0.75, 0.7}, {0.25, 0.4});
  expectLands("lens_shift", 4, Placement::Viewer, {0.75, 0.75}, {0.25, 0.4});
  expectLands("wide", 6, Placement::Drape, {0.15, 0.85}, {0.6, 0.5});
  expectLands("short_throw", 7, Placement::Viewer, {0.8, 0.9}, {0.4, 0.6});
}

}  // namespace
}  // namespace afterglow::render::referee_gl_test

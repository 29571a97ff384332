// Content on a relief, against rays that are marched over it in small steps.
#include "render/scene/relief.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <stdexcept>

#include "render/scene/relief_placer.hpp"

namespace afterglow::render::relief_test {
namespace {

const float kNan = std::numeric_limits<float>::quiet_NaN();
const Eigen::Vector3d kAbove(0.1, -0.2, 5);

/// 1 m x 1 m around the origin: a bump of 15 cm and a step of 5 cm; with a hole.
double landscape(double x, double y) {
  const double r = std::hypot(x + 0.15, y - 0.1);
  return (r < 0.25 ? 0.15 * (1 + std::cos(r / 0.25 * M_PI)) / 2 : 0) + (x > 0.3 ? 0.05 : 0);
}

std::shared_ptr<const Relief> makeRelief(bool has_hole = false) {
  std::vector<float> heights;
  for (int row = 0; row <= 100; ++row) {
    for (int column = 0; column <= 100; ++column) {
      const double x = column * 0.01 - 0.5, y = row * 0.01 - 0.5;
      const bool hole = has_hole && std::hypot(x - 0.1, y + 0.3) < 0.08;
      heights.push_back(hole ? kNan : static_cast<float>(landscape(x, y)));
    }
  }
  return std::make_shared<Relief>(Eigen::Vector2d(-0.5, -0.5), 0.01, 101, 101, heights);
}

Layer makeLayer(Placement placement, const std::shared_ptr<const Relief>& relief) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 1, 2, 0.7;
  T.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  Layer layer;
  layer.placement = placement;
  layer.surface = SurfacePatch{"table", Rigid<World, Surface>(T), {}, relief};
  layer.p_viewer = T * Eigen::Vector3d(1.2, -0.8, 1.1);
  return layer;
}

const Eigen::Isometry3d& pose(const Layer& layer) {
  return layer.surface->T_world_surface.matrix();
}

/// The first point on a ray that is not above the relief, in steps of a tenth of a millimeter.
std::optional<Eigen::Vector3d> march(const Relief& relief, const Eigen::Vector3d& from,
                                     const Eigen::Vector3d& direction) {
  const Eigen::Vector3d step = direction.normalized() * 1e-4;
  Eigen::Vector3d p = from;
  if (from.z() > 0.3) p += step * std::floor((from.z() - 0.3) / -step.z());
  for (; p.z() > -0.05; p += step) {
    const auto height = relief.height(p.head<2>());
    if (height && p.z() <= *height) return p;
  }
  return std::nullopt;
}

Mesh rectangle(const Layer& layer, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Mesh mesh;
  for (const Eigen::Vector3d& p : {low, Eigen::Vector3d(high.x(), low.y(), low.z()), high,
                                   Eigen::Vector3d(low.x(), high.y(), high.z())}) {
    mesh.points.push_back(pose(layer) * p);
    mesh.colors.push_back({static_cast<std::uint8_t>(mesh.points.size() * 50), 100, 50, 255});
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

/// Area on the plane.
double area(const LaidMesh& laid, const Layer& layer) {
  double sum = 0;
  for (const auto& t : laid.mesh.triangles) {
    const Eigen::Vector3d a = pose(layer).inverse() * laid.mesh.points[t[0]];
    const Eigen::Vector3d b = pose(layer).inverse() * laid.mesh.points[t[1]];
    const Eigen::Vector3d c = pose(layer).inverse() * laid.mesh.points[t[2]];
    sum += std::abs((b - a).head<2>().homogeneous().cross((c - a).head<2>().homogeneous()).z()) / 2;
  }
  return sum;
}

TEST(Relief, isTwoTrianglesBetweenFourNodesAndUnknownAroundThem) {
  const Relief relief({1, 2}, 0.5, 2, 3, {0, 1, 2, 3, 4, kNan});
  EXPECT_DOUBLE_EQ(*relief.height({1.25, 2.25}), 1.5);
  EXPECT_DOUBLE_EQ(*relief.height({1.5, 2.25}), 2);
  EXPECT_FALSE(relief.height({1.25, 2.75}));  // one of its nodes is unknown
  EXPECT_FALSE(relief.height({0.99, 2.25}));
  EXPECT_DOUBLE_EQ(relief.knownShare(), 0.5);
  EXPECT_DOUBLE_EQ(relief.least(), 0);
  EXPECT_DOUBLE_EQ(relief.greatest(), 3);
  const Relief bent({0, 0}, 1, 2, 2, {0, 0, 0, 4});
  EXPECT_DOUBLE_EQ(*bent.height({0.5, 0.5}), 2);
  EXPECT_DOUBLE_EQ(*bent.height({0.75, 0.25}), 1);
  EXPECT_DOUBLE_EQ(*bent.height({0.25, 0.75}), 1);
  EXPECT_THROW(Relief({0, 0}, 0.1, 2, 2, {0, 1, 2}), std::logic_error);
}

TEST(Relief, firstHitIsWhereAMarchingRayFindsIt) {
  const auto relief = makeRelief();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> at(-0.6, 0.6), height(0.2, 1.5);
  int hits = 0;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d from(2 * at(random), 2 * at(random), height(random));
    const Eigen::Vector3d way = Eigen::Vector3d(at(random), at(random), 0) - from;
    // Entering from the side below the bump's top is not decided: the march starts above.
    const auto truth = march(*relief, from, way);
    const auto hit = relief->firstHit(from, way);
    if (hit && truth) {
      ++hits;
      EXPECT_LT((*hit - *truth).norm(), 3e-4) << from.transpose() << " -> " << way.transpose();
    } else if (hit) {
      ADD_FAILURE() << "no ray arrives at " << hit->transpose();
    } else if (truth) {  // it came in from the side, below what is around the grid
      EXPECT_GT(truth->head<2>().cwiseAbs().maxCoeff(), 0.49);
    }
  }
  EXPECT_GT(hits, 250);
}

TEST(Relief, ofPointsIsTheirMedianPerCell) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> at(-0.5, 0.5);
  std::normal_distribution<double> noise(0, 0.003);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 200'000; ++i) {
    const double x = at(random), y = at(random);
    const double stray = i % 20 == 0 ? 0.3 : 0;
    points.emplace_back(x, y, landscape(x, y) + noise(random) + stray);
  }
  points.emplace_back(0, 0, 7);
  points.emplace_back(0, 0, std::nan(""));
  const std::vector<Eigen::Vector2d> outline = {
      {-0.5, -0.5}, {0.45, -0.5}, {0.45, 0.5}, {-0.5, 0.5}};
  const Relief relief = reliefFromPoints(points, outline, {});
  EXPECT_GT(relief.knownShare(), 0.99);
  EXPECT_FALSE(relief.height({0.47, 0}));
  double worst = 0;
  for (double x = -0.48; x < 0.44; x += 0.037) {
    for (double y = -0.48; y < 0.48; y += 0.037) {
      if (std::abs(x - 0.3) < 0.02) continue;
      worst = std::max(worst, std::abs(*relief.height({x, y}) - landscape(x, y)));
    }
  }
  EXPECT_LT(worst, 0.007);
}

TEST(Relief, ofNoPointsOrTooManyCellsIsRefused) {
  const auto refusal = [](const std::vector<Eigen::Vector3d>& points) -> std::string {
    try {
      reliefFromPoints(points, {}, {});
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal({}), "no points near the surface within its outline");
  EXPECT_EQ(refusal({{0, 0, 0.9}}), "no points near the surface within its outline");
  EXPECT_EQ(refusal({{0, 0, 0}, {1000, 1000, 0}}), "too large for so small cells");
  EXPECT_EQ(refusal({{0, 0, 0}, {1, 0.001, 0}}), "smaller than a cell");
}

TEST(ReliefPlacer, drapesAlongThePlanesNormal) {
  const auto relief = makeRelief();
  const Layer layer = makeLayer(Placement::Drape, relief);
  const ReliefPlacer placer(layer, pose(layer) * kAbove);
  LaidMesh laid;
  placer.lay(rectangle(layer, {-0.4, -0.4, 0.3}, {0.25, 0.4, 0.5}), laid);
  ASSERT_EQ(laid.heights.size(), laid.mesh.points.size());
  EXPECT_NEAR(area(laid, layer), 0.65 * 0.8, 1e-6);
  for (std::size_t i = 0; i < laid.mesh.points.size(); ++i) {
    const Eigen::Vector3d p = pose(layer).inverse() * laid.mesh.points[i];
    EXPECT_NEAR(p.z(), landscape(p.x(), p.y()), 0.002);
    EXPECT_NEAR(laid.heights[i], 0.3 + (p.y() + 0.4) / 0.8 * 0.2, 1e-6);
  }
}

TEST(ReliefPlacer, trianglesFollowTheReliefBetweenTheirCorners) {
  const auto relief = makeRelief();
  for (const Placement placement : {Placement::Drape, Placement::Viewer}) {
    const Layer layer = makeLayer(placement, relief);
    const ReliefPlacer placer(layer, pose(layer) * kAbove);
    LaidMesh laid;
    placer.lay(rectangle(layer, {-0.4, -0.35, 0.1}, {0.2, 0.35, 0.1}), laid);
    ASSERT_GT(laid.mesh.triangles.size(), 100u);
    double worst = 0;
    for (const auto& t : laid.mesh.triangles) {
      const Eigen::Vector3d middle =
          pose(layer).inverse() *
          Eigen::Vector3d(
              (laid.mesh.points[t[0]] + laid.mesh.points[t[1]] + laid.mesh.points[t[2]]) / 3);
      const auto height = relief->height(middle.head<2>());
      ASSERT_TRUE(height);
      worst = std::max(worst, std::abs(middle.z() - *height));
    }
    EXPECT_LT(worst, 1e-9);
  }
}

/// Where a ray meets a smooth hill, to a micrometer: it is above it first.
template <typename Hill>
Eigen::Vector3d meeting(const Hill& hill, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d way = to - from;
  double above = 1 - 0.05 / way.norm(), below = 1 + 0.05 / way.norm();
  for (int i = 0; i < 30; ++i) {
    const double middle = (above + below) / 2;
    const Eigen::Vector3d p = from + middle * way;
    (p.z() > hill(p.x(), p.y()) ? above : below) = middle;
  }
  return from + above * way;
}

/// The light that is sent to a place of the relief falls on the real hill, which is round between
/// the nodes; the content is meant for where it lies over the hill, or before it for the viewer.
TEST(ReliefPlacer, lightOnASmoothReliefLandsWithinHalfAMillimeterOfWhereItIsMeant) {
  const auto hill = [](double x, double y) {
    return 0.06 * std::exp(-10 * (x * x + y * y)) + 0.02 * std::sin(6 * x + 4 * y);
  };
  std::vector<float> heights;
  for (int i = 0; i < 101 * 101; ++i) {
    heights.push_back(static_cast<float>(hill(i % 101 * 0.01 - 0.5, i / 101 * 0.01 - 0.5)));
  }
  const auto relief =
      std::make_shared<Relief>(Eigen::Vector2d(-0.5, -0.5), 0.01, 101, 101, heights);
  const Eigen::Vector3d light(-0.6, -0.9, 1.2);
  for (const Placement placement : {Placement::Drape, Placement::Viewer}) {
    const Layer layer = makeLayer(placement, relief);
    const Eigen::Isometry3d T_surface_world = pose(layer).inverse();
    const Eigen::Vector3d eye = T_surface_world * layer.p_viewer;
    LaidMesh laid;
    ReliefPlacer(layer, pose(layer) * light)
        .lay(rectangle(layer, {-0.4, -0.35, 0.1}, {0.3, 0.35, 0.15}), laid);
    ASSERT_GT(laid.mesh.triangles.size(), 5000u);
    double worst = 0;
    for (const auto& t : laid.mesh.triangles) {
      const auto corner = [&](std::size_t i) -> const Eigen::Vector3d& {
        return laid.mesh.points[t[i]];
      };
      for (const Eigen::Vector3d& sent :
           {corner(0), Eigen::Vector3d((corner(0) + corner(1)) / 2),
            Eigen::Vector3d((corner(0) + corner(1) + corner(2)) / 3)}) {
        const Eigen::Vector3d p = T_surface_world * sent;
        const Eigen::Vector3d meant = placement == Placement::Viewer
                                          ? meeting(hill, eye, p)
                                          : Eigen::Vector3d(p.x(), p.y(), hill(p.x(), p.y()));
        worst = std::max(worst, (meeting(hill, light, p) - meant).norm());
      }
    }
    EXPECT_LT(worst, 0.0005) << (placement == Placement::Viewer ? "viewer" : "drape");
    RecordProperty(placement == Placement::Viewer ? "viewer_um" : "drape_um",
                   static_cast<int>(1e6 * worst));
  }
}

TEST(ReliefPlacer, viewerSeesContentThroughWhereItIsLaid) {
  const auto relief = makeRelief();
  const Layer layer = makeLayer(Placement::Viewer, relief);
  const Eigen::Vector3d eye = pose(layer).inverse() * layer.p_viewer;
  const ReliefPlacer placer(layer, pose(layer) * kAbove);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> at(-0.45, 0.45), height(-0.1, 0.4);
  int placed = 0;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d content(at(random), at(random), height(random));
    const auto truth = march(*relief, eye, content - eye);
    const auto spot = placer.place(pose(layer) * content);
    if (!spot || !truth) continue;
    ++placed;
    EXPECT_LT((pose(layer).inverse() * *spot - *truth).norm(), 3e-4);
  }
  EXPECT_GT(placed, 150);
}

TEST(ReliefPlacer, leavesHolesAndWhatIsAroundDark) {
  const auto relief = makeRelief(true);
  const Layer layer = makeLayer(Placement::Drape, relief);
  const ReliefPlacer placer(layer, pose(layer) * kAbove);
  LaidMesh laid;
  placer.lay(rectangle(layer, {-50, -50, 0.2}, {50, 50, 0.2}), laid);  // far over all borders
  EXPECT_NEAR(area(laid, layer), relief->knownShare(), 1e-6);          // the hole is made of cells
  for (const auto& t : laid.mesh.triangles) {
    const Eigen::Vector3d middle =
        (laid.mesh.points[t[0]] + laid.mesh.points[t[1]] + laid.mesh.points[t[2]]) / 3;
    EXPECT_TRUE(relief->height((pose(layer).inverse() * middle).head<2>()));
  }
  EXPECT_LT(laid.mesh.triangles.size(), 60'000u);
}

TEST(ReliefPlacer, isDarkWhereTheReliefItselfIsInTheLightsWay) {
  const auto relief = makeRelief();
  const Layer layer = makeLayer(Placement::Drape, relief);
  const Eigen::Vector3d light(0.9, 0.1, 0.25);  // low: the bump throws a long shadow
  const ReliefPlacer placer(layer, pose(layer) * light);
  LaidMesh laid;
  placer.lay(rectangle(layer, {-0.49, -0.49, 0.2}, {0.29, 0.49, 0.2}), laid);
  for (std::size_t i = 0; i < laid.mesh.points.size(); i += 29) {
    const Eigen::Vector3d p = pose(layer).inverse() * laid.mesh.points[i];
    // A little higher: rays that just touch the bump may be taken either way.
    const auto lit = march(*relief, light, p + Eigen::Vector3d(0, 0, 0.001) - light);
    if (lit) {
      EXPECT_GT((*lit - light).norm(), (p - light).norm() - 0.02);
    }
  }
  EXPECT_FALSE(placer.place(pose(layer) * Eigen::Vector3d(-0.42, 0.1, 0)));
  EXPECT_TRUE(placer.place(pose(layer) * Eigen::Vector3d(0.1, 0.1, 0)));
  EXPECT_LT(area(laid, layer), 0.78 * 0.98 - 0.02);
}

TEST(ReliefPlacer, isForTheSameReliefLightAndViewerOnly) {
  const Layer draped = makeLayer(Placement::Drape, makeRelief());
  Layer viewed = draped, moved = draped, turned = draped, other = draped;
  viewed.placement = Placement::Viewer;
  moved.p_viewer.x() += 1;
  turned.surface->T_world_surface = {};
  other.surface->relief = makeRelief();
  const ReliefPlacer placer(draped, kAbove), viewers(viewed, kAbove);
  EXPECT_TRUE(placer.isFor(draped, kAbove));
  EXPECT_TRUE(placer.isFor(moved, kAbove)) << "a draped layer has no viewer";
  EXPECT_FALSE(placer.isFor(draped, 2 * kAbove));
  for (const Layer* layer : {&viewed, &turned, &other}) EXPECT_FALSE(placer.isFor(*layer, kAbove));
  moved.placement = Placement::Viewer;
  EXPECT_TRUE(viewers.isFor(viewed, kAbove));
  EXPECT_FALSE(viewers.isFor(moved, kAbove));
}

/// Inner edges belong to two triangles: a crack would leave some with one.
TEST(ReliefPlacer, leavesNoCracks) {
  const auto relief = makeRelief();
  for (const Placement placement : {Placement::Drape, Placement::Viewer}) {
    const Layer layer = makeLayer(placement, relief);
    const ReliefPlacer placer(layer, pose(layer) * kAbove);
    LaidMesh laid;
    const Eigen::Vector2d low(-0.3, -0.2), high(0.4, 0.25);  // over bump and step
    placer.lay(rectangle(layer, {low.x(), low.y(), 0}, {high.x(), high.y(), 0}), laid);
    using Place = std::array<double, 3>;
    std::map<std::pair<Place, Place>, int> edges;
    for (const auto& t : laid.mesh.triangles) {
      for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d &a = laid.mesh.points[t[i]], &b = laid.mesh.points[t[(i + 1) % 3]];
        const auto rounded = [](const Eigen::Vector3d& p) {
          return Place{std::round(p.x() * 1e8), std::round(p.y() * 1e8), std::round(p.z() * 1e8)};
        };
        Place from = rounded(a), to = rounded(b);
        if (from == to) continue;
        if (to < from) std::swap(from, to);
        ++edges[{from, to}];
      }
    }
    int inner_cracks = 0, pairs = 0;
    for (const auto& [edge, count] : edges) {
      pairs += count == 2 ? 1 : 0;
      if (placement != Placement::Drape || count == 2) continue;
      const Eigen::Vector3d a = pose(layer).inverse() * (Eigen::Vector3d(edge.first.data()) / 1e8);
      const double to_border = std::min((a.head<2>() - low).cwiseAbs().minCoeff(),
                                        (a.head<2>() - high).cwiseAbs().minCoeff());
      inner_cracks += to_border > 1e-7 ? 1 : 0;
    }
    EXPECT_EQ(inner_cracks, 0);
    EXPECT_GT(pairs, static_cast<int>(edges.size()) * 8 / 10);
  }
}

TEST(ReliefPlacer, survivesContentAsHighAsTheEyeAndAbsurdlyLarge) {
  const auto relief = makeRelief();
  const Layer layer = makeLayer(Placement::Viewer, relief);
  const ReliefPlacer placer(layer, pose(layer) * kAbove);
  LaidMesh laid;
  placer.lay(rectangle(layer, {-1e6, -1e6, -3}, {1e6, 1e6, 9}), laid);
  EXPECT_LT(laid.mesh.triangles.size(), 100'000u);
  placer.lay(rectangle(layer, {-1e30, -1e30, 0}, {1e30, 1e30, 0}), laid);
  EXPECT_LT(laid.mesh.triangles.size(), 100'000u);
  placer.lay(rectangle(layer, {-0.1, -0.1, 2}, {0.1, 0.1, 2}), laid);
  EXPECT_TRUE(laid.mesh.triangles.empty());
  Layer flat = layer;
  flat.surface->relief.reset();
  EXPECT_THROW(ReliefPlacer(flat, kAbove), std::logic_error);
}

}  // namespace
}  // namespace afterglow::render::relief_test

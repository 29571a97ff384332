// Triangles before they are drawn: placement, cutting and splitting, against calib's projection.
#include "render/compose/triangle_projector.hpp"

#include <gtest/gtest.h>

#include "tests/support/optics.hpp"
#include "tests/support/seen_triangles.hpp"

namespace afterglow::render::triangle_projector_test {
namespace {

Rigid<World, Surface> tiltedSurface() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()) *
                Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()))
                   .toRotationMatrix();
  T.translation() << 0.4, -0.2, 0.9;
  return Rigid<World, Surface>(T);
}

Layer placedLayer(Placement placement) {
  Layer layer;
  layer.name = "/path";
  layer.placement = placement;
  layer.surface = SurfacePatch{"table", tiltedSurface(), {}};
  layer.p_viewer = tiltedSurface() * Eigen::Vector3d(0.5, -1, 1.6);
  return layer;
}

Eigen::Vector3d placed(const Layer& layer, const Eigen::Vector3d& p_world) {
  return (placementMatrix(layer) * p_world.homogeneous()).hnormalized();
}

TEST(Placement, drapesAlongTheNormal) {
  const Eigen::Vector3d p_world = tiltedSurface() * Eigen::Vector3d(0.3, -0.4, 0.25);
  const Eigen::Vector3d expected = tiltedSurface() * Eigen::Vector3d(0.3, -0.4, 0);
  EXPECT_LT((placed(placedLayer(Placement::Drape), p_world) - expected).norm(), 1e-12);
}

TEST(Placement, putsContentWhereTheViewerSeesItOnThePlane) {
  const Layer layer = placedLayer(Placement::Viewer);
  const Eigen::Vector3d p_world = tiltedSurface() * Eigen::Vector3d(0.3, 0.4, 0.25);
  const Eigen::Vector3d q = placed(layer, p_world);
  EXPECT_NEAR((tiltedSurface().inverse() * q).z(), 0, 1e-12);
  const Eigen::Vector3d ray = p_world - layer.p_viewer;
  EXPECT_LT((q - layer.p_viewer).cross(ray).norm(), 1e-12);
}

TEST(Placement, withoutSurfaceOrViewerAboveItIsAnError) {
  Layer layer = placedLayer(Placement::Viewer);
  layer.p_viewer = tiltedSurface() * Eigen::Vector3d(0, 0, -1);
  EXPECT_THROW(placementMatrix(layer), std::logic_error);
  layer.surface.reset();
  EXPECT_THROW(placementMatrix(layer), std::logic_error);
  layer.placement = Placement::Direct;
  EXPECT_EQ(placementMatrix(layer), Eigen::Matrix4d::Identity());
}

/// A scene of one shape, seen from the world's origin along z.
Scene inFront(Shape shape) {
  Layer layer;
  layer.drawables.push_back({{}, std::move(shape), {}});
  return {{layer}};
}

Triangles bigTriangle() {
  Triangles triangles;
  triangles.points = {{-30, -20, 2}, {40, -25, 3}, {5, 50, 1}};
  return triangles;
}

using test::SeenTriangles;

Eigen::Vector3d position(const SeenTriangles& seen, std::size_t index) {
  const LightVertex& v = seen.triangles().vertices[seen.triangles().indices[index]];
  return {v.x, v.y, v.z};
}

const calib::Lens kWorstLens = test::lens(1280, 800, 700, 640, 400, {-0.35, 0, 0, 0, 0});

TEST(TriangleProjector, keepsContentWithinTheFold) {
  const SeenTriangles seen(kWorstLens, inFront(bigTriangle()));
  ASSERT_GT(seen.triangles().indices.size(), 100u);
  double largest = 0;
  for (std::size_t i = 0; i < seen.triangles().indices.size(); ++i) {
    const Eigen::Vector3d p = position(seen, i);
    largest = std::max(largest, (p.head<2>() / p.z()).norm());
  }
  EXPECT_LE(largest, kWorstLens.fold_radius * (1 + 1e-6));
  EXPECT_GT(largest, 0.99 * kWorstLens.fold_radius) << "all of the image is covered";
}

/// How far the image of an edge's points lies from the straight line between its ends' images.
double sag(const calib::Lens& lens, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector2d from = *calib::project(lens, a), to = *calib::project(lens, b);
  if ((to - from).norm() < 1e-6) return 0;
  const Eigen::Vector2d along = (to - from).normalized();
  double largest = 0;
  for (int i = 1; i < 8; ++i) {
    const Eigen::Vector2d at = *calib::project(lens, a + (b - a) * i / 8) - from;
    largest = std::max(largest, std::abs(along.x() * at.y() - along.y() * at.x()));
  }
  return largest;
}

TEST(TriangleProjector, splitsUntilNoEdgeBendsByATenthOfAPixel) {
  for (const calib::Lens& lens :
       {kWorstLens, test::viewsonic({-0.35, 0.12, 0.002, -0.0015, -0.03})}) {
    calib::Lens within = lens;  // the fold's own edge may be cut a hair outside
    within.fold_radius = std::numeric_limits<double>::infinity();
    const SeenTriangles seen(lens, inFront(bigTriangle()));
    double largest = 0;
    for (std::size_t i = 0; i < seen.triangles().indices.size(); i += 3) {
      for (std::size_t k = 0; k < 3; ++k) {
        largest = std::max(largest,
                           sag(within, position(seen, i + k), position(seen, i + (k + 1) % 3)));
      }
    }
    std::printf("%zu triangles, largest bend %.3f px\n", seen.triangles().indices.size() / 3,
                largest);
    EXPECT_LT(largest, 0.1);
  }
}

TEST(TriangleProjector, doesNotSplitForALensThatBendsNothing) {
  const SeenTriangles seen(test::viewsonic(), inFront(bigTriangle()));
  EXPECT_LE(seen.triangles().indices.size(), 15u);
}

TEST(TriangleProjector, dropsWhatIsBehindTheLens) {
  Triangles triangles;
  triangles.points = {{-1, 0, -2}, {1, 0, -2}, {0, 1, -0.5f}};
  const SeenTriangles seen(test::viewsonic(), inFront(triangles));
  EXPECT_TRUE(seen.triangles().indices.empty());
}

TEST(TriangleProjector, sharesTheVerticesOfSmallThings) {
  Cube cube;
  cube.size = Eigen::Vector3f::Constant(0.005f);
  Layer layer;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << 0, -0.3, 1.5;
  layer.drawables.push_back({Rigid<World, World>(T), cube, {}});
  const SeenTriangles seen(kWorstLens, {{layer}});
  EXPECT_LE(seen.triangles().vertices.size(), 7u) << "one corner is out of sight";
  EXPECT_LE(seen.triangles().indices.size(), 18u) << "at most three faces are seen";
  EXPECT_GE(seen.triangles().indices.size(), 6u);
}

TEST(TriangleProjector, leavesOutWhatIsNotFinite) {
  PointCloud cloud;
  cloud.points = {{0, -0.1f, 1}, {std::nanf(""), 0, 1}, {0, INFINITY, 1}};
  for (const PointStyle style : {PointStyle::Points, PointStyle::Squares, PointStyle::FlatSquares,
                                 PointStyle::Spheres, PointStyle::Boxes}) {
    cloud.style = style;
    const SeenTriangles seen(test::viewsonic(), inFront(cloud));
    for (const LightVertex& v : seen.triangles().vertices) {
      EXPECT_TRUE(std::isfinite(v.x + v.y + v.z + v.depth));
    }
  }
}

TEST(TriangleProjector, drawsBlendedThingsLastAndFarthestFirst) {
  Layer layer;
  for (const double z : {1.0, 3.0, 2.0}) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() << 0, -0.2 * z, z;
    layer.drawables.push_back({Rigid<World, World>(T), Cube{}, {1, 1, 1, 0.5f}});
  }
  layer.drawables.push_back({{}, Cube{}, {}});
  const SeenTriangles seen(test::viewsonic(), {{layer}});
  const std::vector<Piece>& pieces = seen.pieces();
  ASSERT_EQ(pieces.size(), 4u);
  EXPECT_TRUE(pieces[0].is_opaque);
  const auto z = [&](std::size_t i) { return position(seen, pieces[i].first).z(); };
  EXPECT_GT(z(1), z(2));
  EXPECT_GT(z(2), z(3));
}

TEST(TriangleProjector, leavesOutWhatIsTransparent) {
  Layer layer;
  layer.drawables.push_back({{}, Cube{}, {1, 1, 1, 0}});
  EXPECT_TRUE(SeenTriangles(test::viewsonic(), {{layer}}).pieces().empty());
}

TEST(Pieces, joinNeighborsThatAreOpaqueAndOfAKindOnly) {
  using Kind = Piece::Kind;
  std::vector<Piece> pieces = {
      {Kind::Points, false, 0, 1, 0.9},     {Kind::Triangles, true, 0, 6, 0},
      {Kind::Triangles, false, 6, 3, 0.95}, {Kind::Triangles, true, 9, 3, 0},
      {Kind::Triangles, true, 12, 9, 0},    {Kind::Outlines, true, 21, 1, 0},
      {Kind::Outlines, true, 22, 1, 0}};
  sortForDrawing(pieces);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ranges;
  for (const Piece& piece : pieces) ranges.emplace_back(piece.first, piece.count);
  const decltype(ranges) expected = {{0, 6}, {9, 12}, {21, 2}, {6, 3}, {0, 1}};
  EXPECT_EQ(ranges, expected);
}

}  // namespace
}  // namespace afterglow::render::triangle_projector_test

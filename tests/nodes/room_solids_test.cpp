#include "nodes/observer/room_view.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "render/scene/relief.hpp"

namespace afterglow::nodes::room_solids_test {
namespace {

render::Triangles trianglesOf(const render::SurfacePatch& surface) {
  const auto solids = surfaceSolids({{}, {surface}}, {2, 1, 1.5});
  EXPECT_EQ(solids.size(), 1u);
  return std::get<render::Triangles>(solids.at(0).shape);
}

TEST(RoomSolids, areSlabsUnderTheirSurfacesPlane) {
  // Clockwise, and not convex: the corner at the origin is cut out.
  const render::Triangles slab =
      trianglesOf({"table", {}, {{0, 1}, {1, 1}, {1, -1}, {-1, -1}, {-1, 0}, {0, 0}}});
  float top_area = 0, lowest = 0;
  for (std::size_t i = 0; i < slab.points.size(); i += 3) {
    const Eigen::Vector3f &a = slab.points[i], &b = slab.points[i + 1], &c = slab.points[i + 2];
    const Eigen::Vector3f normal = (b - a).cross(c - a);
    if (a.z() > -0.01f && b.z() > -0.01f && c.z() > -0.01f) top_area += normal.z() / 2;
    lowest = std::min({lowest, a.z(), b.z(), c.z()});
  }
  EXPECT_NEAR(top_area, 3, 1e-5) << "its upper side looks up";
  EXPECT_NEAR(lowest, -0.031, 1e-6);
}

TEST(RoomSolids, reachAroundTheProjectorWhereASurfaceIsEndless) {
  for (const Eigen::Vector3f& p : trianglesOf({"floor", {}, {}}).points) {
    EXPECT_NEAR(std::abs(p.x() - 2), 6, 1e-5);
    EXPECT_NEAR(std::abs(p.y() - 1), 6, 1e-5);
  }
}

TEST(RoomSolids, haveTheHeightsOfAReliefAndItsHoles) {
  const float hole = std::numeric_limits<float>::quiet_NaN();
  const auto relief = std::make_shared<const render::Relief>(
      Eigen::Vector2d(0, 0), 0.5, 3, 2, std::vector<float>{0, 0.1f, 0, 0, 0.2f, hole});
  const render::Triangles land = trianglesOf({"heap", {}, {}, relief});
  ASSERT_EQ(land.points.size(), 6u);
  EXPECT_NEAR(land.points[2].z(), 0.2 - 0.001, 1e-6);
  EXPECT_NEAR(land.points[2].x(), 0.5, 1e-6);
}

}  // namespace
}  // namespace afterglow::nodes::room_solids_test

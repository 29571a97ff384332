// The beam and the surfaces as RViz gets them.
#include "nodes/conversion/beam_markers.hpp"

#include <gtest/gtest.h>
#include <visualization_msgs/Marker.h>

#include <algorithm>
#include <cmath>

#include "tests/support/optics.hpp"

namespace afterglow::nodes::beam_markers_test {
namespace {

using visualization_msgs::Marker;

TEST(BeamMarkers, endWhereTheLensShowsTheImagesBorder) {
  const calib::Lens lens = test::viewsonic({-0.1, 0.02, 0, 0, 0});  // its axis lies beside the image
  const auto array = beamMarkers(lens, "projector", "beam", 2);
  ASSERT_EQ(array.markers.size(), 2u);
  std::size_t at_end = 0;
  for (const Marker& marker : array.markers) {
    EXPECT_EQ(marker.header.frame_id, "projector");
    EXPECT_TRUE(marker.header.stamp.isZero());
    EXPECT_TRUE(marker.frame_locked);
    for (const auto& p : marker.points) {
      if (p.z == 0) continue;  // the lens
      EXPECT_DOUBLE_EQ(p.z, 2);
      const auto pixel = calib::project(lens, {p.x, p.y, p.z});
      ASSERT_TRUE(pixel);
      const double beside = std::min({std::abs(pixel->x() + 0.5), std::abs(pixel->x() - 1279.5),
                                      std::abs(pixel->y() + 0.5), std::abs(pixel->y() - 799.5)});
      EXPECT_LT(beside, 1e-6);
      ++at_end;
    }
  }
  EXPECT_EQ(array.markers[0].type, Marker::TRIANGLE_LIST);
  EXPECT_EQ(array.markers[0].points.size(), 3u * 4 * 16 * 2) << "RViz shows one side";
  EXPECT_EQ(array.markers[1].type, Marker::LINE_LIST);
  EXPECT_EQ(array.markers[1].points.size(), 2u * (4 * 16 + 4));
  EXPECT_GT(at_end, 0u);
}

TEST(SurfaceMarkers, areClosedOutlinesThatReplaceTheLastOnes) {
  render::SurfacePatch floor{"floor", {}, {{0, 0}, {1, 0}, {1, 1}}};
  render::SurfacePatch endless{"wall", {}, {}};
  const auto array = surfaceMarkers({floor, endless}, "map");
  ASSERT_EQ(array.markers.size(), 2u);
  EXPECT_EQ(array.markers[0].action, Marker::DELETEALL);
  EXPECT_EQ(array.markers[1].header.frame_id, "map");
  EXPECT_EQ(array.markers[1].type, Marker::LINE_STRIP);
  ASSERT_EQ(array.markers[1].points.size(), 4u);
  EXPECT_EQ(array.markers[1].points[3].x, 0);
  EXPECT_EQ(array.markers[1].points[2].y, 1);
}

}  // namespace
}  // namespace afterglow::nodes::beam_markers_test

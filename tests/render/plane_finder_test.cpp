#include "render/surfaces/plane_finder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "render/scene/triangulate.hpp"
#include "tests/support/depth_image.hpp"
#include "tests/support/real_data.hpp"

namespace afterglow::render::plane_finder_test {
namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr double kNoise = 0.003;

/// As a depth camera sees them, from above: noise everywhere.
class Room {
 public:
  /// A rectangle, `spacing` between its points.
  void addRectangle(const Eigen::Isometry3d& T, double width, double depth, double spacing) {
    for (double x = -width / 2; x <= width / 2; x += spacing) {
      for (double y = -depth / 2; y <= depth / 2; y += spacing) {
        points.push_back(T * Eigen::Vector3d(x, y, noise_(random_)));
      }
    }
  }
  void addStray(std::size_t count) {
    std::uniform_real_distribution<double> x(-2, 2), z(-0.1, 1.8);
    for (std::size_t i = 0; i < count; ++i) {
      points.emplace_back(x(random_), x(random_), z(random_));
    }
    const double nan = std::nan("");
    points.emplace_back(nan, nan, nan);
    points.emplace_back(1e30, 0, 0);
  }
  Points points;

 private:
  std::mt19937 random_{7};
  std::normal_distribution<double> noise_{0, kNoise};
};

Eigen::Isometry3d at(double x, double y, double z, double tilt = 0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() << x, y, z;
  T.linear() = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()).toRotationMatrix();
  return T;
}

double angle(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

std::string refusal(const Points& points, const PlaneSearch& search) {
  try {
    findPlane(points, search);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(PlaneFinder, findsATableAmongFloorAnotherTableAndStrayPoints) {
  Room room;
  room.addRectangle(at(0.3, -0.2, 0.72, 0.03), 1.2, 0.7, 0.008);
  room.addRectangle(at(-1.4, 0.5, 0.72), 0.5, 0.5, 0.008);  // level with it, but apart
  room.addRectangle(at(0.4, -0.1, 0.80), 0.3, 0.2, 0.004);  // a box's lid, seen densely
  room.addStray(3000);
  const FoundPlane table = findPlane(room.points, {});
  const Eigen::Isometry3d truth = at(0.3, -0.2, 0.72, 0.03);
  EXPECT_LT(angle(table.T_points_plane.linear().col(2), truth.linear().col(2)), 0.002);
  EXPECT_LT(std::abs((truth.inverse() * table.T_points_plane.translation()).z()), 0.001);
  EXPECT_LT((truth.inverse() * table.T_points_plane.translation()).head<2>().norm(),
            0.03);  // strays at its rim
  EXPECT_NEAR(table.area, 1.2 * 0.7, 0.03);
  EXPECT_NEAR(table.residual, kNoise, 0.0005);
  EXPECT_LE(table.polygon.size(), 24u);
  for (const double x : {-0.58, 0.0, 0.58}) {
    for (const double y : {-0.33, 0.0, 0.33}) {
      const Eigen::Vector3d p = table.T_points_plane.inverse() * (truth * Eigen::Vector3d(x, y, 0));
      EXPECT_TRUE(isInside(table.polygon, p.head<2>())) << x << " " << y;
    }
  }
}

TEST(PlaneFinder, takesTheLargestAreaHoweverDenselyOthersWereSeen) {
  Room room;
  room.addRectangle(at(0, 0, 0), 1, 1, 0.009);
  room.addRectangle(at(0.3, 0.3, 0.5), 0.6, 0.6, 0.003);  // more points
  EXPECT_NEAR(findPlane(room.points, {}).T_points_plane.translation().z(), 0, 0.002);
}

TEST(PlaneFinder, givesTheSamePlaneAgain) {
  Room room;
  room.addRectangle(at(0, 0, 0.7), 1, 0.6, 0.008);
  room.addStray(5000);
  const FoundPlane once = findPlane(room.points, {}), again = findPlane(room.points, {});
  EXPECT_TRUE(once.T_points_plane.isApprox(again.T_points_plane, 0));
  EXPECT_EQ(once.polygon, again.polygon);
}

TEST(PlaneFinder, outlineFollowsACornerOfATable) {
  Room room;
  room.addRectangle(at(0, 0, 0), 1.2, 0.4, 0.008);
  room.addRectangle(at(-0.4, 0.5, 0), 0.4, 0.6, 0.008);
  const FoundPlane table = findPlane(room.points, {});
  const auto covers = [&](double x, double y) {
    const Eigen::Vector3d p = table.T_points_plane.inverse() * Eigen::Vector3d(x, y, 0);
    return isInside(table.polygon, p.head<2>());
  };
  EXPECT_TRUE(covers(-0.4, 0.7));
  EXPECT_TRUE(covers(0.5, 0.1));
  EXPECT_FALSE(covers(0.3, 0.5));
  EXPECT_NEAR(table.area, 1.2 * 0.4 + 0.4 * 0.6, 0.03);
}

TEST(PlaneFinder, refusesInOneClearLine) {
  EXPECT_EQ(refusal({}, {}), "too few points to find a plane in: 0 a centimeter apart");
  Room wall;
  wall.addRectangle(at(0, 0, 0, 1.2), 1, 1, 0.009);
  EXPECT_EQ(refusal(wall.points, {}).find("no plane among 12544 points: the largest part of one "),
            0u)
      << refusal(wall.points, {});
  PlaneSearch sideways;
  sideways.up = Eigen::Vector3d(std::sin(1.2), 0, std::cos(1.2));
  EXPECT_NO_THROW(findPlane(wall.points, sideways));
  Room noise;
  noise.addStray(2000);
  EXPECT_EQ(refusal(noise.points, {}).find("no plane"), 0u) << refusal(noise.points, {});
}

class TableOfADepthImage : public testing::TestWithParam<test::Source> {};

TEST_P(TableOfADepthImage, isFoundWithAllThatIsOnIt) {
  const bool is_real = GetParam() == test::Source::Real;
  const auto cloud = is_real ? test::readLabeledCloud(test::realData("table_scene.pcd"))
                             : test::DepthImage().cloud();
  ASSERT_FALSE(cloud.points.empty());
  PlaneSearch search;
  search.up = Eigen::Vector3d(0, -0.7, -0.7);  // the camera looks down at it
  const FoundPlane table = findPlane(cloud.points, search);
  constexpr std::uint32_t kTable = test::DepthImage::kTable;  // as the real one's makers labeled it
  std::size_t on_table = 0, found = 0, wrong = 0;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    const Eigen::Vector3d p = table.T_points_plane.inverse() * cloud.points[i];
    const bool is_on = std::abs(p.z()) < 0.015 && isInside(table.polygon, p.head<2>());
    const bool is_table = cloud.labels[i] == kTable;
    on_table += is_table ? 1 : 0;
    found += is_on && is_table ? 1 : 0;
    wrong += is_on && !is_table ? 1 : 0;
  }
  std::printf(
      "%zu points, %.3f m2, %zu corners, residual %.2f mm; of %zu points labeled table "
      "%.1f %% lie on it, and %zu others\n",
      table.count, table.area, table.polygon.size(), 1e3 * table.residual, on_table,
      100.0 * static_cast<double>(found) / static_cast<double>(on_table), wrong);
  EXPECT_GT(found, on_table * 95 / 100);
  EXPECT_LT(wrong, on_table * 3 / 100);
  EXPECT_LT(table.residual, 0.005);
  if (is_real) return;
  const Eigen::Isometry3d truth = test::DepthImage().T_camera_table;
  EXPECT_LT(angle(table.T_points_plane.linear().col(2), truth.linear().col(2)), 0.005);
  EXPECT_LT(std::abs((truth.inverse() * table.T_points_plane.translation()).z()), 0.002);
}

INSTANTIATE_TEST_SUITE_P(On, TableOfADepthImage, test::sources(), test::sourceName);

}  // namespace
}  // namespace afterglow::render::plane_finder_test

#include "calib/verify/tag_layout.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/targets/tag_family.hpp"

namespace afterglow::calib {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

Tag withRim(const Tag& tag) {
  Tag wide = tag;
  const Eigen::Vector2d middle = middleOf(tag);
  for (Eigen::Vector2d& corner : wide.corners) {
    corner = middle + (kTagCells + 2.0) / kTagCells * (corner - middle);
  }
  return wide;
}

/// Whether a line along one of a's edges has all of b on its other side.
bool isSeparated(const Tag& a, const Tag& b) {
  const Eigen::Vector2d middle = middleOf(a);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& from = a.corners[i];
    const Eigen::Vector2d along = a.corners[(i + 1) % 4] - from;
    const double inside = cross(along, middle - from);
    const bool all_beyond = std::all_of(
        b.corners.begin(), b.corners.end(),
        [&](const Eigen::Vector2d& corner) { return inside * cross(along, corner - from) <= 0; });
    if (all_beyond) return true;
  }
  return false;
}

}  // namespace

Tag squareTag(int id, const Eigen::Vector2d& center, double side_m, double yaw_rad) {
  const Eigen::Rotation2Dd turn(yaw_rad);
  const double h = side_m / 2;
  Tag tag;
  tag.id = id;
  const std::array<Eigen::Vector2d, 4> upright = {Eigen::Vector2d(-h, h), Eigen::Vector2d(h, h),
                                                  Eigen::Vector2d(h, -h), Eigen::Vector2d(-h, -h)};
  for (std::size_t i = 0; i < 4; ++i) tag.corners[i] = center + turn * upright[i];
  return tag;
}

Eigen::Vector2d middleOf(const Tag& tag) {
  const Eigen::Vector2d a = tag.corners[2] - tag.corners[0], b = tag.corners[3] - tag.corners[1];
  const double area = cross(a, b);
  if (!(std::abs(area) > 0)) return (tag.corners[0] + tag.corners[2]) / 2;
  return tag.corners[0] + cross(tag.corners[1] - tag.corners[0], b) / area * a;
}

bool areTooClose(const Tag& a, const Tag& b) {
  const Tag wide_a = withRim(a), wide_b = withRim(b);
  return !isSeparated(wide_a, wide_b) && !isSeparated(wide_b, wide_a);
}

}  // namespace afterglow::calib

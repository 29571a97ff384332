#include "calib/verify/tag_layout.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/landing.hpp"
#include "calib/median.hpp"
#include "calib/targets/tag.hpp"

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

/// Returns true if a line along one of a's edges has all of b on its other side.
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

std::optional<Eigen::Vector2d> pixelOf(const Eigen::Vector2d& place, const Lens& camera,
                                       const Rigid<Camera, Surface>& T_camera_surface) {
  return project(camera, T_camera_surface * Eigen::Vector3d(place.x(), place.y(), 0));
}

bool isInPicture(const Tag& tag, const Lens& camera,
                 const Rigid<Camera, Surface>& T_camera_surface) {
  return std::all_of(tag.corners.begin(), tag.corners.end(), [&](const Eigen::Vector2d& corner) {
    const auto pixel = pixelOf(corner, camera, T_camera_surface);
    return pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= camera.width - 1 &&
           pixel->y() <= camera.height - 1;
  });
}

/// Empty if the tag was not detected, or the camera has no ray or pixel for one of the middles.
std::optional<TagDrift> driftOfTag(const Tag& tag, const std::vector<Tag>& detected,
                                   const Rigid<Camera, Surface>& T_camera_surface,
                                   const Lens& camera) {
  const Eigen::Vector2d place = middleOf(tag);
  const auto expected = pixelOf(place, camera, T_camera_surface);
  if (!expected) return std::nullopt;
  std::optional<TagDrift> least;
  for (const Tag& seen : detected) {
    if (seen.id != tag.id) continue;
    const Eigen::Vector2d pixel = middleOf(seen);
    const auto seen_at = landing(camera, pixel, T_camera_surface);
    if (!seen_at) continue;
    const TagDrift drift{tag.id, (pixel - *expected).norm(), 1000 * (*seen_at - place).norm()};
    if (!least || drift.px < least->px) least = drift;
  }
  return least;
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

Drift driftOf(const std::vector<Tag>& layout, const std::vector<Tag>& detected,
              const Rigid<Camera, Surface>& T_camera_surface, const Lens& camera) {
  Drift drift;
  std::vector<double> px, mm;
  for (const Tag& tag : layout) {
    if (isInPicture(tag, camera, T_camera_surface)) ++drift.expected;
    if (const auto one = driftOfTag(tag, detected, T_camera_surface, camera)) {
      drift.seen.push_back(*one);
      px.push_back(one->px);
      mm.push_back(one->mm);
    }
  }
  drift.median_px = median(px, 0);
  drift.median_mm = median(mm, 0);
  return drift;
}

}  // namespace afterglow::calib

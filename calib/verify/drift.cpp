#include "calib/verify/drift.hpp"

#include <algorithm>
#include <optional>

#include "calib/landing.hpp"
#include "calib/median.hpp"
#include "calib/verify/tag_layout.hpp"

namespace afterglow::calib {
namespace {

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

/// Empty if it was not detected, or one of the two middles is nowhere.
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

/// \file
/// A cloud's points onto the image: one matrix, then the exact lens for each.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calib/lens.hpp"
#include "render/compose/thing_list.hpp"
#include "render/compose/workers.hpp"
#include "render/paint/screen_point.hpp"
#include "render/scene/scene.hpp"

namespace afterglow::render {

/// Coordinates of a point, its distance from the cloud's first one, are floats: the error on the
/// image is under 0.01 px for clouds of some ten meters wherever they are.
class PointProjector {
 public:
  explicit PointProjector(const calib::Lens& lens) : lens_(lens) {}

  /// Appends to `points`, of which `used` are in use, what of the cloud reaches the image or up to
  /// kPointMargin over its border: points in front of the lens, within its fold, visible. Style and
  /// `color` as Drawable has them.
  PointRun project(const PointCloud& cloud, const Color& color, const PointPlacement& placement,
                   Workers& workers, std::vector<ScreenPoint>& points, std::size_t& used) const;

 private:
  calib::Lens lens_;
};

}  // namespace afterglow::render

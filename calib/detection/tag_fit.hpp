/// \file
/// A tag's corners to a hundredth of a pixel: the whole tag, with all edges of its cells, is fitted
/// to the image, through the lenses of camera and projector. AprilTag's own edge refinement, whose
/// result is the start, is 4 to 11 times above the Cramer-Rao bound; this fit comes near the bound.
#pragma once

#include <optional>

#include "calib/detection/light.hpp"
#include "calib/detection/observe.hpp"
#include "calib/lens.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {

/// The tag to be fitted: a tag on a flat board (`corners` in meters), or one in a projector's
/// picture (`corners` in its pixels) that lies on a flat board.
struct TagTarget {
  Tag tag;
  TagCells cells;
  const Lens* projector = nullptr;  ///< the lens whose distortion bends the tag; outlives the call
};

struct TagFit {
  SeenTag seen;
  double correlation = 0;  ///< likeness of picture and fitted tag, 1 if perfect
};

/// `start`: the corners in the picture's pixels, within about half a cell. Empty if the tag is not
/// there, is not wholly inside the picture, or has no contrast.
std::optional<TagFit> fitTag(const Light& light, const Lens& camera, const RayMap& rays,
                             const TagTarget& target, const std::array<Eigen::Vector2d, 4>& start);

}  // namespace afterglow::calib

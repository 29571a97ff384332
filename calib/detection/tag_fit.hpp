/// \file
/// A tag's corners to a hundredth of a pixel: the whole tag, with all edges of its cells, is fitted
/// to the image, through the lenses of camera and projector. AprilTag's own edge refinement, whose
/// result is the start, is 4 to 11 times above the Cramer-Rao bound; this fit comes near the bound.
///
/// Photographs as linear light. Cameras write gamma-encoded values, in which blur makes dark
/// squares shrink by 0.3 to 0.4 px a side; edges are therefore fitted to linear light.
#pragma once

#include <optional>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/lens.hpp"
#include "calib/picture.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {

/// Row-major linear light, 1 for a saturated pixel (or any unit, for a quotient of two), with a
/// weight for each pixel.
struct Light {
  int width = 0, height = 0;
  std::vector<float> value;
  std::vector<float> weight;  ///< 1 / variance; 0 for saturated and black pixels
};

constexpr double kGrayNoise = 1.5;  ///< gray levels: the noise of 8-bit cameras' sensors
/// Decodes gamma 2.2; the weights come from kGrayNoise.
Light linearLight(const Picture& picture);

/// The light with the pattern divided by the light without it, pixel by pixel: the print on the
/// board, the uneven light and the camera's vignette cancel, the pattern remains. The weight is
/// lower where the plain image has edges, and 0 where one of the two has weight 0. Throws
/// std::invalid_argument unless both have one size.
Light quotient(const Light& pattern, const Light& plain);

/// Gamma-encoded gray levels for a detector, the 99th percentile of the light at 220.
Picture encoded(const Light& light);

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

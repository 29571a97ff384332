/// \file
/// Whether the robot still is where its transforms say: known tags on the floor, where they should
/// be in the camera's picture and where they are.
#pragma once

#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {

struct TagDrift {
  int id = 0;
  double px = 0;  ///< between the tag's expected and seen middle, in the photograph
  double mm = 0;  ///< the same on the floor
};

struct Drift {
  int expected = 0;                     ///< tags that should be wholly in the picture
  std::vector<TagDrift> seen;           ///< those of the layout that were found
  double median_px = 0, median_mm = 0;  ///< of `seen`; 0 if that is empty
};

/// `layout`: corners in meters on the surface; `detected`: corners in pixels, any ids. Of an id
/// that was detected twice the one nearer to its place counts. Pure.
Drift driftOf(const std::vector<Tag>& layout, const std::vector<Tag>& detected,
              const Rigid<Camera, Surface>& T_camera_surface, const Lens& camera);

}  // namespace afterglow::calib

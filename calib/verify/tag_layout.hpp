/// \file
/// Tags at known places of a floor or a table, and whether the robot still is where its transforms
/// say: how far the tags in a photograph are from where they should be.
#pragma once

#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {

/// Corners in meters on the z = 0 plane of `frame`, seen from above: x to the right, y up, as on a
/// board.
struct TagLayout {
  std::string frame;  ///< tf's frame; empty where tf is not used
  std::string family = "tag36h11";
  std::vector<Tag> tags;     ///< printed, lying there
  std::vector<Tag> targets;  ///< places where tags of light shall fall; may be empty
};

/// Returns a square tag whose upright picture is turned counterclockwise by `yaw`.
Tag squareTag(int id, const Eigen::Vector2d& center, double side_m, double yaw_rad);

/// The tag's middle in any perspective: where the diagonals meet.
Eigen::Vector2d middleOf(const Tag& tag);

/// Returns true if two tags, each with the white rim of a cell that it needs, overlap.
bool areTooClose(const Tag& a, const Tag& b);

struct TagDrift {
  int id = 0;
  double px = 0;  ///< distance between the tag's expected and seen middle, in the photograph
  double mm = 0;  ///< the same on the floor
};

struct Drift {
  int expected = 0;                     ///< tags that should be wholly in the picture
  std::vector<TagDrift> seen;           ///< the tags of the layout that were found
  double median_px = 0, median_mm = 0;  ///< median of `seen`; 0 if that is empty
};

/// `layout`: corners in meters on the surface; `detected`: corners in pixels, any ids. Of an id
/// that was detected twice the one nearer to its place counts. Pure.
Drift driftOf(const std::vector<Tag>& layout, const std::vector<Tag>& detected,
              const Rigid<Camera, Surface>& T_camera_surface, const Lens& camera);

}  // namespace afterglow::calib

/// \file
/// What a square fiducial tag is to everyone here: an id and four corners.
#pragma once

#include <Eigen/Core>
#include <array>

namespace afterglow::calib {

/// Corners of the black square (where AprilTag's detector finds them, not of the white rim round
/// it): top left, top right, bottom right, bottom left of the upright picture of the tag. Units and
/// frame are those of whatever holds the tag: meters on a board (x right, y up), pixels in a
/// pattern or a photograph (y down, the center of the top-left pixel is (0, 0)).
struct Tag {
  int id = 0;
  std::array<Eigen::Vector2d, 4> corners;
};

}  // namespace afterglow::calib

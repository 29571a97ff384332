/// \file
/// AprilTags: their corners, their families and the black and white cells of each. Source of the
/// cells: libapriltag's code tables.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <vector>

extern "C" struct apriltag_family;

namespace afterglow::calib {

/// A tag somewhere. Corners of the black square (where AprilTag's detector finds them, not of the
/// white rim around it): top left, top right, bottom right, bottom left of the upright tag. Units
/// and frame depend on where the tag is: meters on a board (x right, y up), pixels in a pattern or
/// a photograph (y down, the center of the top-left pixel is (0, 0)).
struct Tag {
  int id = 0;
  std::array<Eigen::Vector2d, 4> corners;
};

/// libapriltag's own description of a family.
using FamilyHandle = std::unique_ptr<apriltag_family, void (*)(apriltag_family*)>;

/// Throws std::invalid_argument naming the families there are.
FamilyHandle makeFamily(const std::string& family);

/// A tag is kTagCells x kTagCells cells: a black frame one cell wide round 6 x 6 cells of code. It
/// needs a white rim of one more cell to be found.
constexpr int kTagCells = 8;

/// black[row][column], row 0 at the top.
using TagCells = std::array<std::array<bool, kTagCells>, kTagCells>;

/// Families whose tags look like that and that have enough ids for a board and a pattern.
extern const std::vector<std::string> kTagFamilies;  // tag36h11, tag36h10

/// Returns the number of the family's ids. Throws std::invalid_argument naming the families there
/// are.
int tagCount(const std::string& family);

/// Throws std::invalid_argument for an unknown family or an id it does not have.
TagCells tagCells(const std::string& family, int id);

}  // namespace afterglow::calib

/// \file
/// The cells of AprilTag's tags: what is black and what is white. Source: libapriltag's code
/// tables.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace afterglow::calib {

/// A tag is kTagCells x kTagCells cells: a black frame one cell wide round 6 x 6 cells of code. It
/// needs a white rim of one more cell to be found.
constexpr int kTagCells = 8;

/// black[row][column], row 0 at the top.
using TagCells = std::array<std::array<bool, kTagCells>, kTagCells>;

/// Families whose tags look like that and that have enough ids for a board and a pattern.
extern const std::vector<std::string> kTagFamilies;  // tag36h11, tag36h10

/// How many ids the family has. Throws std::invalid_argument naming the families there are.
int tagCount(const std::string& family);

/// Throws std::invalid_argument for an unknown family or an id it does not have.
TagCells tagCells(const std::string& family, int id);

}  // namespace afterglow::calib

/// \file
/// The printed calibration board: tags round the rim, a free white middle for the projected ones.
#pragma once

#include <Eigen/Core>
#include <array>
#include <set>
#include <string>
#include <vector>

#include "calib/targets/tag.hpp"

namespace afterglow::calib {

/// Board frame (tag `Surface` of calib/frames.hpp): origin in the board's middle, x right, y up, z
/// out of the paper toward the viewer; meters.
struct Board {
  std::string family = "tag36h11";
  Eigen::Vector2d size_m = Eigen::Vector2d::Zero();  ///< the sheet
  std::vector<Tag> tags;                             ///< corners in meters
  double ruler_m = 0;  ///< length of the ruler printed on it, to check the print with; 0: none
};

/// Ids of a board are below this, those of a pattern from this on.
constexpr int kFirstPatternId = 100;

/// A paper size. Boards of ISO 216's, which all have one shape, have ids of their own: without them
/// an image could not tell a small board near by from a large one far away. American sizes have the
/// ids from 0 on, as each has a shape of its own.
struct Paper {
  const char* name;
  Eigen::Vector2d size_m;  ///< landscape
  int first_id;            ///< the first of an ISO size's kPaperTags
};
constexpr int kPaperTags = 20;
extern const std::array<Paper, 7> kPapers;
/// The paper of this size, either way up; null if there is none.
const Paper* paperOf(const Eigen::Vector2d& size_m);

/// "A3", or "600 x 400 mm".
std::string boardName(const Board& board);
/// Returns the board to which tags belong that are not of this board: "the tags in the picture (40
/// to 59) are those of an A3 board; the layout describes ...", with an advice. Empty if it cannot
/// be told.
std::string otherBoardText(const std::set<int>& ids, const Board& board);

/// Empty, or why the ids of this board's tags do not tell its size: boards of older versions.
std::string unsureSizeText(const Board& board);

/// A board for a sheet: tags as large as five and a quarter of them fit the shorter side. Throws
/// std::invalid_argument for a sheet below 0.1 m or above 5 m a side, or so narrow that there is
/// no free middle or there are not enough ids. Sheets that are no paper size have ids from 0 on and
/// a ruler as long as there is room for, which tells one from another of the same shape.
Board makeBoard(const Eigen::Vector2d& size_m, const std::string& family = "tag36h11");

}  // namespace afterglow::calib

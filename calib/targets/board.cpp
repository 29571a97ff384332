#include "calib/targets/board.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calib/number_text.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {
namespace {

/// Tags along the shorter side, each with its white rim; the rest is margin.
constexpr double kTagsAlongShortSide = 5.25;

Tag squareTag(int id, const Eigen::Vector2d& middle, double side) {
  const double h = side / 2;
  return {id,
          {middle + Eigen::Vector2d(-h, h), middle + Eigen::Vector2d(h, h),
           middle + Eigen::Vector2d(h, -h), middle + Eigen::Vector2d(-h, -h)}};
}

/// Printers and people like round numbers: cells in tenths of a millimeter.
double cellOf(const Eigen::Vector2d& size_m) {
  const double pitch = size_m.minCoeff() / kTagsAlongShortSide;
  return std::floor(pitch / (kTagCells + 2) * 1e4 + 1e-6) / 1e4;
}

/// The longest round length that fits between the side columns.
double rulerFor(double room_m, bool is_paper) {
  if (!is_paper) return std::floor(0.85 * room_m * 1e3) / 1e3;
  for (double length : {0.2, 0.1, 0.05, 0.02}) {
    if (length < 0.9 * room_m) return length;
  }
  return 0;
}

std::string idRange(int first, int last) {
  return std::to_string(first) + " to " + std::to_string(last);
}

}  // namespace

// A2, the default, has the ids that boards of all sizes once had, so that boards in use stay valid.
const std::array<Paper, 7> kPapers = {{{"A0", {1.189, 0.841}, 80},
                                       {"A1", {0.841, 0.594}, 60},
                                       {"A2", {0.594, 0.420}, 0},
                                       {"A3", {0.420, 0.297}, 40},
                                       {"A4", {0.297, 0.210}, 20},
                                       {"Tabloid", {0.4318, 0.2794}, 0},
                                       {"Letter", {0.2794, 0.2159}, 0}}};

const Paper* paperOf(const Eigen::Vector2d& size_m) {
  constexpr double kSame_m = 1e-4;
  for (const Paper& paper : kPapers) {
    const bool is_same = (size_m - paper.size_m).norm() < kSame_m ||
                         (size_m.reverse() - paper.size_m).norm() < kSame_m;
    if (is_same) return &paper;
  }
  return nullptr;
}

std::string boardName(const Board& board) {
  if (const Paper* paper = paperOf(board.size_m)) return paper->name;
  return exactText(std::round(board.size_m.x() * 1e4) / 10) + " x " +
         exactText(std::round(board.size_m.y() * 1e4) / 10) + " mm";
}

std::string otherBoardText(const std::set<int>& ids, const Board& board) {
  constexpr int kFewest = 2;
  const auto shown =
      std::max_element(kPapers.begin(), kPapers.end(), [&](const Paper& a, const Paper& b) {
        const auto count = [&](const Paper& paper) {
          return std::distance(ids.lower_bound(paper.first_id),
                               ids.lower_bound(paper.first_id + kPaperTags));
        };
        return count(a) < count(b);
      });
  const auto count = std::distance(ids.lower_bound(shown->first_id),
                                   ids.lower_bound(shown->first_id + kPaperTags));
  if (count < kFewest || board.tags.empty()) return "";
  return "the tags in the picture (" + idRange(shown->first_id, shown->first_id + kPaperTags - 1) +
         ") are those of an " + shown->name + " board" +
         (shown->first_id == 0 ? ", or of one that is older or of another shape" : "") +
         "; the layout (board.yaml) describes " + boardName(board) + " with tags " +
         idRange(board.tags.front().id, board.tags.back().id) +
         ": use the board.yaml that was written with the printed board";
}

std::string unsureSizeText(const Board& board) {
  const Paper* const paper = paperOf(board.size_m);
  if (paper == nullptr || board.tags.empty() || board.tags.front().id == paper->first_id) return "";
  return "the layout (board.yaml) is of an older version, whose boards of all sizes have the same "
         "tags: nothing here tells whether the print is " +
         boardName(board);
}

Board makeBoard(const Eigen::Vector2d& size_m, const std::string& family) {
  tagCount(family);
  if (!(size_m.array() >= 0.1).all() || !(size_m.array() <= 5).all()) {
    throw std::invalid_argument("a board of " + exactText(size_m.x()) + " x " +
                                exactText(size_m.y()) +
                                " m: expected 0.1 to 5 m a side (meters, not millimeters)");
  }
  const double cell = cellOf(size_m), pitch = cell * (kTagCells + 2);
  const int columns = static_cast<int>(size_m.x() / pitch + 1e-9);
  const int rows = static_cast<int>(size_m.y() / pitch + 1e-9);
  if (2 * (columns + rows) - 4 > kFirstPatternId) {
    throw std::invalid_argument("a board of " + exactText(size_m.x()) + " x " +
                                exactText(size_m.y()) + " m is too narrow: its rim would need " +
                                std::to_string(2 * (columns + rows) - 4) + " tags, at most " +
                                std::to_string(kFirstPatternId) + " are for boards");
  }
  Board board;
  board.family = family;
  board.size_m = size_m;
  // The tags are spread so that the outer ones leave half the spare room as margin.
  const double margin =
      (size_m.y() < size_m.x() ? size_m.y() - rows * pitch : size_m.x() - columns * pitch) / 2;
  // Steps of whole half millimeters keep edges on the pixels of the board's picture.
  const auto step = [&](double size, int count) {
    return std::floor((size - 2 * margin - pitch) / (count - 1) * 2e3 + 1e-6) / 2e3;
  };
  const Eigen::Vector2d steps(step(size_m.x(), columns), -step(size_m.y(), rows));
  const Eigen::Vector2d first = -0.5 * steps.cwiseProduct(Eigen::Vector2d(columns - 1, rows - 1));
  const Paper* const paper = paperOf(size_m);
  int id = paper != nullptr ? paper->first_id : 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const bool is_rim = row == 0 || row == rows - 1 || column == 0 || column == columns - 1;
      if (!is_rim) continue;
      const Eigen::Vector2d middle = first + steps.cwiseProduct(Eigen::Vector2d(column, row));
      board.tags.push_back(squareTag(id++, middle, cell * kTagCells));
    }
  }
  board.ruler_m = rulerFor(size_m.x() - 2 * (margin + pitch), paper != nullptr);
  return board;
}

}  // namespace afterglow::calib

#include "calib/targets/board.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calib/number_text.hpp"
#include "calib/targets/tag_family.hpp"

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

}  // namespace

Board makeBoard(const Eigen::Vector2d& size_m, const std::string& family) {
  tagCount(family);
  if (!(size_m.minCoeff() >= 0.1) || !(size_m.maxCoeff() <= 5)) {
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
  int id = 0;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const bool is_rim = row == 0 || row == rows - 1 || column == 0 || column == columns - 1;
      if (!is_rim) continue;
      const Eigen::Vector2d middle = first + steps.cwiseProduct(Eigen::Vector2d(column, row));
      board.tags.push_back(squareTag(id++, middle, cell * kTagCells));
    }
  }
  // The longest of the round lengths that fits between the side columns.
  const double room = size_m.x() - 2 * (margin + pitch);
  for (double length : {0.2, 0.1, 0.05, 0.02}) {
    if (length < 0.9 * room) {
      board.ruler_m = length;
      break;
    }
  }
  return board;
}

}  // namespace afterglow::calib

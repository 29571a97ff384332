// Writing; reading is target_reader.cpp.
#include "calib/targets/target_files.hpp"

#include <cmath>
#include <filesystem>

#include "calib/file_replacement.hpp"
#include "calib/number_text.hpp"
#include "calib/targets/board_drawing.hpp"
#include "calib/targets/pattern_drawing.hpp"

namespace afterglow::calib {
namespace {

/// To the nanometer: whoever reads it is told 0.0365, not 0.036500000000000005, and 0, not -0.
std::string numberText(double value) { return exactText(std::round(value * 1e9) / 1e9 + 0.0); }

/// `z`: what follows the two coordinates of a corner.
std::string tagsText(const std::vector<Tag>& tags, const std::string& z) {
  std::string text = "tags:\n";
  for (const Tag& tag : tags) {
    text += "  - {id: " + std::to_string(tag.id) + ", corners: [";
    for (const Eigen::Vector2d& corner : tag.corners) {
      text += (&corner == &tag.corners.front() ? "[" : ", [") + numberText(corner.x()) + ", " +
              numberText(corner.y()) + z + "]";
    }
    text += "]}\n";
  }
  return text;
}

std::string boardText(const Board& board) {
  return "# Meters; origin in the board's middle, x right, y up, z out of the paper. Corners of "
         "each black\n# square: top left, top right, bottom right, bottom left. ruler_m is the "
         "printed ruler's length.\nfamily: " +
         board.family + "\nsize_m: [" + numberText(board.size_m.x()) + ", " +
         numberText(board.size_m.y()) + "]\nruler_m: " + numberText(board.ruler_m) +
         "\npicture: board.png\n" + tagsText(board.tags, ", 0");
}

std::string patternText(const Pattern& pattern) {
  return "# Pixels; the center of the top-left pixel is (0, 0), y down. Corners of each black "
         "square: top\n# left, top right, bottom right, bottom left.\nfamily: " +
         pattern.family + "\nwidth: " + std::to_string(pattern.width) +
         "\nheight: " + std::to_string(pattern.height) + "\npicture: pattern.png\n" +
         tagsText(pattern.tags, "");
}

}  // namespace

void writeBoard(const std::string& folder, const Board& board) {
  const std::filesystem::path path(folder);
  FileReplacement files;
  files.add((path / "board.pdf").string(), boardPdf(board));
  files.add((path / "board.png").string(), boardPng(board));
  files.add((path / "board.yaml").string(), boardText(board));
  files.commit();
}

void writePattern(const std::string& folder, const Pattern& pattern) {
  const std::filesystem::path path(folder);
  FileReplacement files;
  files.add((path / "pattern.png").string(), patternPng(pattern));
  files.add((path / "pattern.yaml").string(), patternText(pattern));
  files.commit();
}

}  // namespace afterglow::calib

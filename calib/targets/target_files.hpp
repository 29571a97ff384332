/// \file
/// Boards and patterns as files: layouts as YAML, pictures as PNG, the board also as a PDF of true
/// size.
///
/// A board as a picture and as a page to print: its tags, their ids, and in the free middle a mark
/// of which side is up and a ruler to check the print with.
#pragma once

#include <string>

#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

/// Keys: family, size_m [w, h], ruler_m, picture (the PNG beside it), tags: [{id, corners: four
/// [x, y, 0] in meters}]. Throws std::runtime_error "FILE:LINE: what is wrong" (keys missing, ids
/// twice or unknown to the family, corners that are no square or lie outside the sheet, sizes that
/// look like millimeters).
Board loadBoard(const std::string& yaml_path);
/// Keys: family, width, height, picture, tags: [{id, corners: four [x, y] in px}].
Pattern loadPattern(const std::string& yaml_path);

/// board.pdf, board.png and board.yaml (pattern.png and pattern.yaml) in a folder, which is made.
/// Throws std::runtime_error naming the path that cannot be written.
void writeBoard(const std::string& folder, const Board& board);
void writePattern(const std::string& folder, const Pattern& pattern);

/// A PDF of one page, exactly the sheet, in outlines rather than pixels. Throws std::runtime_error
/// if cairo cannot draw it, std::invalid_argument for a tag that the family does not have.
std::string boardPdf(const Board& board);

/// A PNG that knows its physical size, of the whole sheet edge to edge: pixel x is at
/// (x + 0.5) / width * size_m.x() - size_m.x() / 2. Throws as boardPdf does.
std::string boardPng(const Board& board);

}  // namespace afterglow::calib

/// \file
/// A board as a picture and as a page to print: its tags, their ids, and in the free middle a mark
/// of which side is up and a ruler to check the print with.
#pragma once

#include <string>

#include "calib/targets/board.hpp"

namespace afterglow::calib {

/// A PDF of one page, exactly the sheet, in outlines rather than pixels. Throws std::runtime_error
/// if cairo cannot draw it, std::invalid_argument for a tag that the family does not have.
std::string boardPdf(const Board& board);

/// A PNG that knows its physical size, of the whole sheet edge to edge: pixel x is at
/// (x + 0.5) / width * size_m.x() - size_m.x() / 2. Throws as boardPdf does.
std::string boardPng(const Board& board);

}  // namespace afterglow::calib

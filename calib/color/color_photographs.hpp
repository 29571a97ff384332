/// \file
/// The pictures that a projector shows to have its colors measured, and the photographs of them: a
/// file a color, NN_rrggbb.
#pragma once

#include <string>
#include <vector>

#include "calib/color/color.hpp"

namespace afterglow::calib {

/// colorsToShow() as PNG files of one color each, this many pixels large; the folder is made if it
/// is not there. Returns how many. Throws std::runtime_error naming what cannot be written.
std::size_t writeColorPictures(const std::string& folder, int width, int height);

/// The mean color, in linear light, of what the projector lights: where white is at least half as
/// much brighter than black as where it is most so. The camera stood still, other files of the
/// folder are passed over. Throws std::runtime_error naming the file: unreadable, of another size,
/// overexposed; no black or white; no light that is seen.
std::vector<ColorSample> readColorPhotographs(const std::string& folder);

}  // namespace afterglow::calib

/// \file
/// The projected calibration pattern: tags of two sizes all over the projector's image. A camera
/// far away or of few pixels reads the large tags; a board that covers a small part of the image
/// still holds several small tags.
#pragma once

#include <string>
#include <vector>

#include "calib/picture.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {

struct Pattern {
  std::string family = "tag36h11";
  int width = 0, height = 0;  ///< px, the projector's own resolution
  std::vector<Tag> tags;      ///< corners in px; an edge between two pixels lies at n + 0.5
};

/// The way in which the pattern is photographed.
enum class PatternUse {
  Pairs,   ///< a plain image beside each photograph: tags everywhere
  Singles  ///< alone: a few tags far apart, so that the board's tags are read between them
};

/// Throws std::invalid_argument for a picture below 320 x 200 or above 8192 px a side.
Pattern makePattern(int width, int height, const std::string& family = "tag36h11",
                    PatternUse use = PatternUse::Pairs);

/// The image to project: black (0) and white (255), nothing between. Throws std::invalid_argument
/// for a tag that the family does not have.
Picture patternPicture(const Pattern& pattern);

std::string patternPng(const Pattern& pattern);

}  // namespace afterglow::calib

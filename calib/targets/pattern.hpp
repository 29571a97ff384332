/// \file
/// The projected calibration pattern: tags all over the projector's picture, of two sizes, so that
/// a camera far away or of few pixels reads the large ones, and a board that covers little of a
/// short throw's picture still holds several small ones.
#pragma once

#include <string>
#include <vector>

#include "calib/targets/tag.hpp"

namespace afterglow::calib {

struct Pattern {
  std::string family = "tag36h11";
  int width = 0, height = 0;  ///< px, the projector's own resolution
  std::vector<Tag> tags;      ///< corners in px; an edge between two pixels lies at n + 0.5
};

/// What the pattern is photographed for.
enum class PatternUse {
  Pairs,   ///< with a plain picture beside each: tags everywhere
  Singles  ///< alone: a few tags far apart, so that the board's printed ones are read between them
};

/// Throws std::invalid_argument for a picture below 320 x 200 or above 8192 px a side.
Pattern makePattern(int width, int height, const std::string& family = "tag36h11",
                    PatternUse use = PatternUse::Pairs);

}  // namespace afterglow::calib

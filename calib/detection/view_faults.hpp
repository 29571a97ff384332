/// \file
/// The faults of the photographs of one board pose, told from the tags that were read in them.
#pragma once

#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/detection/tag_detector.hpp"

namespace afterglow::calib {

/// All tags that were read, of any id, before any is left out or refitted.
struct ViewDetections {
  std::vector<DetectedTag> plain;  ///< tags in the plain picture; empty if there is none
  /// Tags in the pattern's picture as it is. Decimation 2 is good enough where there is a plain
  /// one: it tells whether the board moved, and whether the pattern is there at all.
  std::vector<DetectedTag> pattern;
  std::vector<DetectedTag> quotient;  ///< tags in both pictures' quotient; empty: one picture
};

struct ViewFaults {
  std::vector<std::string> faults;  ///< faults with advice; any of them rules the view out
  std::vector<std::string> notes;   ///< odd, but no harm
};

/// Faults: too few tags of the board or of the pattern and, as far as can be told, why (mirrored,
/// another family or another board, over- or underexposed, pictures exchanged, a camera image older
/// than the projector's switch, projector set to rear projection); ids seen at two places; the
/// board moved between the two pictures (printed tags must be read in both for that: `pattern` may
/// not be left empty). Looks at the pixels only where too little was read. Pure; never throws for
/// pictures that TagDetector accepts.
ViewFaults viewFaults(const Photographs& photographs, const ViewDetections& detections,
                      const Board& board, const Pattern& pattern);

}  // namespace afterglow::calib

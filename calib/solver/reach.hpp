/// \file
/// The part of the projector's image that the views cover, as far as the camera sees that image.
#pragma once

#include <string>
#include <vector>

#include "calib/lens.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/solver/refusals.hpp"

namespace afterglow::calib {

/// Cell by cell as in Coverage; a cell is in reach if its light, at the boards' middle distance,
/// falls where the camera sees it and the pattern has corners in it.
struct Reach {
  double covered = 0;  ///< share of the cells in reach that have corners, 0 to 1
  /// left, right, upper, lower: thirds of the part in reach in which there are no corners.
  std::vector<std::string> empty_sides;
};
Reach reachOf(const ProjectorEstimate& estimate, const Lens& camera, const Pattern& pattern,
              const std::vector<PosedView>& views);

/// Refuses if nearly all of the part in reach was never lit on a board.
std::vector<std::string> reachRefusals(const Reach& reach);
/// The parts that will be uncertain: "nothing was seen in the right third of ...".
std::vector<std::string> reachWarnings(const Reach& reach);

}  // namespace afterglow::calib

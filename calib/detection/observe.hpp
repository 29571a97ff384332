/// \file
/// Makes a View of the photographs of one board pose: the tags in them, in the camera's pixels.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/picture.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {

/// Corners in the photograph's pixels.
struct SeenTag : Tag {
  /// Covariance of x0 y0 x1 y1 ... x3 y3, px^2. The corners of a tag come from one fit: their
  /// errors depend on each other.
  Eigen::Matrix<double, 8, 8> covariance = Eigen::Matrix<double, 8, 8>::Identity() * 0.0025;
};

/// The content of the photographs of one pose of the board.
struct View {
  std::string name;                ///< "view_03"
  std::vector<SeenTag> board;      ///< printed tags, ids of the board
  std::vector<SeenTag> projected;  ///< projected tags that lie on the board, ids of the pattern
  /// Faults of the photographs, each with an advice; a view with any is left out.
  std::vector<std::string> faults;
  /// Remarks for the report on what was seen but not used ("tags of the pattern on the floor: 12").
  std::vector<std::string> notes;
};

struct Photographs {
  std::string name;
  Picture pattern;  ///< while the projector shows the pattern
  /// While it shows plain gray (or white): printed tags are then read without the pattern on them,
  /// and projected ones from the quotient of the two, where print and falling light cancel.
  std::optional<Picture> plain;
};

/// The reader of photographs of one camera, board and pattern. Corners are refitted to sub-pixel
/// edges in linear light, through the camera's lens; tags of the pattern that do not lie on the
/// board are left out. Keeps copies of what it is given. One thread at a time for each; share
/// nothing.
class ViewReader {
 public:
  ViewReader(const Board& board, const Pattern& pattern, const Lens& camera);
  ~ViewReader();
  ViewReader(ViewReader&&) noexcept;

  /// Never throws for what a picture shows: its faults are in the view. Throws
  /// std::invalid_argument if a picture is not of the camera's size.
  View observe(const Photographs& photographs) const;

  /// Does what observe does, but quicker: projected tags as AprilTag finds them (to 0.1 px).
  View glance(const Photographs& photographs) const;

  /// Does what observe does, with a rough estimate of the projector's lens: the fit then includes
  /// its distortion, and tags that the detector missed are found where they must be. `first`: the
  /// result of observe or glance.
  View observeAgain(const View& first, const Photographs& photographs, const Lens& projector) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace afterglow::calib

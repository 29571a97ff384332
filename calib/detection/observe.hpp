/// \file
/// From the photographs of one board pose to a View.
#pragma once

#include <memory>
#include <optional>

#include "calib/detection/view.hpp"
#include "calib/frames.hpp"
#include "calib/lens.hpp"
#include "calib/picture.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

struct Photographs {
  std::string name;
  Picture pattern;  ///< while the projector shows the pattern
  /// While it shows plain grey (or white): printed tags are then read without the pattern on them,
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

  /// The same, quicker: projected tags as AprilTag has them (0.1 px), good enough to begin with.
  View glance(const Photographs& photographs) const;

  /// The same, knowing the projector's lens roughly: its distortion is then part of what is fitted,
  /// and tags the detector missed are found where they must be. `first` is what observe or
  /// glance gave.
  View observeAgain(const View& first, const Photographs& photographs, const Lens& projector) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One view, for those who have just one.
View observe(const Photographs& photographs, const Board& board, const Pattern& pattern,
             const Lens& camera);

}  // namespace afterglow::calib

/// \file
/// Makes views of the board, and the check of a calibration, of a camera's images.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>

#include "calib/detection/observe.hpp"
#include "calib/guide/view_taker.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/verify/view_check.hpp"

namespace afterglow::calib {

class TagDetector;

/// Builds views of one board, pattern and camera, of which it keeps copies. One thread at a time.
class ViewBuilder {
 public:
  /// Throws std::invalid_argument for families that libapriltag does not know.
  ViewBuilder(const Board& board, const Pattern& pattern, const Lens& camera);
  ~ViewBuilder();

  const Lens& camera() const { return camera_; }
  /// The quick look at every image: which tags of the board and of the pattern are in it. At half
  /// the resolution where the image has enough of it. Throws std::invalid_argument for images below
  /// 16 px a side.
  WatchedImage look(const Picture& picture, std::int64_t stamp_ns) const;
  /// Keeps the image as a photograph of the view of this name, if it is one.
  void keep(TakerAnswer::Keep kind, const std::string& view_name, Picture picture);

  /// The photographs of the view that is being taken.
  const Photographs& photographs() const { return photographs_; }
  /// The view that the photographs show.
  View read() const;
  /// Measures how far light lands from where the calibration has it, in a view that read() gave.
  ViewCheck check(const View& view, const Calibration& calibration) const;

 private:
  const Board board_;
  const Pattern pattern_;
  const Lens camera_;
  const ViewReader reader_;
  std::set<int> board_ids_, pattern_ids_;
  std::unique_ptr<TagDetector> detector_;
  std::unique_ptr<TagDetector> pattern_detector_;  ///< null if the families are the same
  Photographs photographs_;
};

}  // namespace afterglow::calib

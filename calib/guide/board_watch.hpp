/// \file
/// The quick look at every frame: which tags of the board and of the pattern are in it.
#pragma once

#include <cstdint>
#include <memory>
#include <set>

#include "calib/guide/view_taker.hpp"
#include "calib/picture.hpp"
#include "calib/targets/board.hpp"
#include "calib/targets/pattern.hpp"

namespace afterglow::calib {

class TagDetector;

/// Looks at half the resolution where the picture has enough of it. One thread at a time.
class BoardWatch {
 public:
  /// Throws std::invalid_argument for families that libapriltag does not know.
  BoardWatch(const Board& board, const Pattern& pattern, int picture_width);
  ~BoardWatch();

  /// Throws std::invalid_argument for pictures below 16 px a side.
  WatchedFrame look(const Picture& picture, std::int64_t stamp_ns) const;

 private:
  std::set<int> board_ids_, pattern_ids_;
  std::unique_ptr<TagDetector> detector_;
  std::unique_ptr<TagDetector> pattern_detector_;  ///< none if the families are the same
};

}  // namespace afterglow::calib

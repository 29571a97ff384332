/// \file
/// AprilTags in a photograph, by libapriltag with its own edge refinement at full resolution.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "calib/picture.hpp"
#include "calib/targets/tag.hpp"

namespace afterglow::calib {

struct DetectedTag : Tag {
  double margin = 0;  ///< AprilTag's decision margin: gray levels between bit and threshold
  int hamming = 0;    ///< bits that had to be corrected
};

/// AprilTag's own edge refinement makes corners better; without it they are those of the squares as
/// first found, as AprilTag's regression data have them.
enum class TagEdges { Refined, AsFound };

/// Finds tags of one family; used by one thread at a time.
class TagDetector {
 public:
  /// Decimation 1 finds all; 2 is four times as fast and good enough to know what is in view.
  /// Throws std::invalid_argument for an unknown family.
  explicit TagDetector(const std::string& family, double decimation = 1,
                       TagEdges edges = TagEdges::Refined);
  ~TagDetector();
  TagDetector(TagDetector&&) noexcept;

  /// Corners in OpenCV's convention ((0, 0) is the center of the top-left pixel; AprilTag's own is
  /// half a pixel off). Throws std::invalid_argument for pictures below 16 px a side, on which
  /// libapriltag 3.3.0 crashes, or whose pixels do not match their size. An id seen several times
  /// is there several times.
  std::vector<DetectedTag> detect(const Picture& picture) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Left and right exchanged, to recognize pictures taken in a mirror or projected from behind.
Picture mirrored(const Picture& picture);

}  // namespace afterglow::calib

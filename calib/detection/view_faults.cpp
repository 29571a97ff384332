#include "calib/detection/view_faults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <set>

#include "calib/targets/tag.hpp"

namespace afterglow::calib {
namespace {

using Tags = std::vector<DetectedTag>;

constexpr std::size_t kFewestBoardTags = 4;
/// Pattern tags that must be read where they should not be; one alone may be a misreading.
constexpr std::size_t kTelling = 3;
/// Corners of still boards differ by noise and the detector's own errors: a few tenths of a pixel.
constexpr double kBoardMoved_px = 1;

std::set<int> idsOf(const std::vector<Tag>& tags) {
  std::set<int> ids;
  for (const Tag& tag : tags) ids.insert(tag.id);
  return ids;
}

/// Returns each id once, in ascending order.
Tags among(const Tags& seen, const std::set<int>& ids) {
  Tags found;
  for (const DetectedTag& tag : seen) {
    if (ids.count(tag.id) > 0) found.push_back(tag);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const DetectedTag& a, const DetectedTag& b) { return a.id < b.id; });
  found.erase(std::unique(found.begin(), found.end(),
                          [](const DetectedTag& a, const DetectedTag& b) { return a.id == b.id; }),
              found.end());
  return found;
}

/// "3", "3 and 5", "3, 5, 7 and 12 more"
std::string listed(const std::set<int>& ids) {
  constexpr std::size_t kMost = 5;
  std::string text;
  std::size_t i = 0;
  for (int id : ids) {
    if (i == kMost && ids.size() > kMost + 1) {
      return text + " and " + std::to_string(ids.size() - kMost) + " more";
    }
    const char* separator = i == 0 ? "" : (i + 1 == ids.size() ? " and " : ", ");
    text += separator + std::to_string(id);
    ++i;
  }
  return text;
}

std::string plural(std::size_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

Eigen::Vector2d middleOf(const Tag& tag) {
  return (tag.corners[0] + tag.corners[1] + tag.corners[2] + tag.corners[3]) / 4;
}

/// Ids that are seen at two places at least a tag's side apart.
std::set<int> seenTwice(const Tags& seen, const std::set<int>& ids) {
  std::set<int> twice;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    for (std::size_t k = i + 1; k < seen.size(); ++k) {
      if (seen[i].id != seen[k].id || ids.count(seen[i].id) == 0) continue;
      const double side = (seen[i].corners[1] - seen[i].corners[0]).norm();
      if ((middleOf(seen[i]) - middleOf(seen[k])).norm() > side) twice.insert(seen[i].id);
    }
  }
  return twice;
}

/// The share of pixels for which the condition holds.
double share(const Picture& picture, const std::function<bool(std::uint8_t)>& holds) {
  if (picture.pixels.empty()) return 0;
  return double(std::count_if(picture.pixels.begin(), picture.pixels.end(), holds)) /
         double(picture.pixels.size());
}

/// The fault of the exposure; empty if it is right.
std::string badExposure(const Picture& picture) {
  const double white = share(picture, [](std::uint8_t gray) { return gray >= 253; });
  if (white > 0.25) {
    return "the picture is overexposed (" + std::to_string(std::lround(100 * white)) +
           " % white): shorten the exposure or dim the room";
  }
  const double black = share(picture, [](std::uint8_t gray) { return gray < 16; });
  if (black > 0.75) {
    return "the picture is underexposed (" + std::to_string(std::lround(100 * black)) +
           " % black): lengthen the exposure or turn on the light";
  }
  return "";
}

/// Pixels of two photographs of the same light differ by noise only.
bool isSamePicture(const Picture& a, const Picture& b) {
  constexpr int kNoise_gray = 16;
  std::size_t different = 0;
  for (std::size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); ++i) {
    if (std::abs(int(a.pixels[i]) - int(b.pixels[i])) > kNoise_gray) ++different;
  }
  return double(different) < 0.002 * double(a.pixels.size());
}

std::size_t countRead(const std::string& family, const Picture& picture, const std::set<int>& ids) {
  return among(TagDetector(family).detect(picture), ids).size();
}

class Judge {
 public:
  Judge(const Photographs& photographs, const ViewDetections& detections, const Board& board,
        const Pattern& pattern)
      : photographs_(photographs),
        detections_(detections),
        board_(board),
        pattern_(pattern),
        board_ids_(idsOf(board.tags)),
        pattern_ids_(idsOf(pattern.tags)),
        has_plain_(photographs.plain),
        unlit_(has_plain_ ? *photographs.plain : photographs.pattern),
        read_unlit_(has_plain_ ? detections.plain : detections.pattern) {}

  ViewFaults judge() {
    judgeUnknown();
    judgePrinted();
    judgeTwins();
    if (has_plain_) judgePair();
    if (result_.faults.empty()) judgeProjected();
    return result_;
  }

 private:
  void fault(const std::string& text) { result_.faults.push_back(text); }

  void judgeUnknown() {
    for (const DetectedTag& tag : read_unlit_) {
      // A tag with corrected bits may be no tag at all.
      if (board_ids_.count(tag.id) + pattern_ids_.count(tag.id) == 0 && tag.hamming == 0) {
        unknown_.insert(tag.id);
      }
    }
    if (!unknown_.empty()) {
      result_.notes.push_back("tags of neither board nor pattern: " + listed(unknown_));
    }
  }

  void judgePrinted() {
    const std::size_t printed = among(read_unlit_, board_ids_).size();
    const std::size_t needed = std::min(kFewestBoardTags, board_ids_.size());
    if (printed >= needed) return;
    const std::string found = printed == 0
                                  ? "none of the board's tags was read"
                                  : "only " + std::to_string(printed) + " of the board's " +
                                        plural(board_ids_.size(), "tag") + " were read, " +
                                        std::to_string(needed) + " are needed";
    fault(found + ": " + whyNotPrinted());
  }

  std::string whyNotPrinted() const {
    const std::string other = otherBoardText(unknown_, board_);
    if (!other.empty()) return other;
    if (unknown_.size() >= 2 || unknown_.size() >= board_ids_.size()) {
      return "the picture has unknown tags (" + listed(unknown_) +
             "): another board than the layout says?";
    }
    if (!has_plain_ && among(read_unlit_, pattern_ids_).size() >= kTelling) {
      return "the pattern's light lies on the printed tags (if the board is in view), and there is "
             "no "
             "picture without it: "
             "take a second one while the projector shows plain gray, or show the pattern of "
             "`afterglow calibrate pattern --single`";
    }
    const Picture turned = mirrored(unlit_);
    if (countRead(board_.family, turned, board_ids_) >= kTelling) {
      return "the picture is mirrored: turn off the camera's mirroring, or photograph the board "
             "directly";
    }
    for (const std::string& family : kTagFamilies) {
      if (family == board_.family) continue;
      if (TagDetector(family).detect(unlit_).size() >= kTelling) {
        return "the picture's tags are of the family " + family + ", the layout says " +
               board_.family + ": use the board's own layout file";
      }
    }
    const std::string exposure = badExposure(unlit_);
    if (!exposure.empty()) return exposure;
    return "hold the whole board into the camera's picture, flat, sharp and not too far";
  }

  void judgeTwins() {
    const std::set<int> printed = seenTwice(read_unlit_, board_ids_);
    if (!printed.empty()) {
      fault("tags seen at two places: " + listed(printed) +
            ": two boards in the picture? Leave one");
    }
    const std::set<int> projected =
        seenTwice(has_plain_ ? detections_.quotient : detections_.pattern, pattern_ids_);
    if (!projected.empty()) {
      fault("tags of the pattern seen at two places: " + listed(projected) +
            ": a print or a screen showing the pattern, or a second projector? Take it away");
    }
  }

  /// Faults that only two pictures show: they are exchanged, or the board moved between them.
  void judgePair() {
    const bool plain_shows = among(detections_.plain, pattern_ids_).size() >= kTelling;
    const bool pattern_shows =
        std::max(among(detections_.pattern, pattern_ids_).size(),
                 among(detections_.quotient, pattern_ids_).size()) >= kTelling;
    const bool is_same = isSamePicture(photographs_.pattern, *photographs_.plain);
    if (plain_shows && pattern_shows) {
      fault(
          "both pictures show the pattern: the plain one was taken before the projector had "
          "switched; wait longer after switching");
    } else if (plain_shows) {
      fault(
          "the plain picture shows the pattern and the other does not: the pictures are "
          "exchanged, or each is one switch late; wait longer after switching");
    } else if (is_same && !pattern_shows) {
      fault(
          "both pictures show the same, without the pattern: the projector did not switch (or is "
          "too faint for this room), or the camera's frame is older than the switch; wait longer "
          "after switching");
    } else {
      judgeMotion();
    }
  }

  void judgeMotion() {
    std::vector<double> dx, dy;
    for (const DetectedTag& before : among(detections_.plain, board_ids_)) {
      for (const DetectedTag& after : among(detections_.pattern, board_ids_)) {
        if (before.id != after.id) continue;
        for (std::size_t i = 0; i < 4; ++i) {
          dx.push_back(after.corners[i].x() - before.corners[i].x());
          dy.push_back(after.corners[i].y() - before.corners[i].y());
        }
      }
    }
    if (dx.size() < 4 * 2) return;
    const double moved = std::hypot(median(dx), median(dy));
    // A turn about the picture's middle moves tags in all directions: their mean is not enough.
    std::vector<double> ways;
    for (std::size_t i = 0; i < dx.size(); ++i) ways.push_back(std::hypot(dx[i], dy[i]));
    const double way = std::max(moved, median(ways));
    if (way <= kBoardMoved_px) return;
    fault(fmt::format(
        "the board moved between the two pictures ({:.1f} px): rest it on something and keep still",
        way));
  }

  static double median(std::vector<double> values) {
    const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }

  /// Checked only if there is no other fault.
  void judgeProjected() {
    const std::size_t projected = std::max(among(detections_.pattern, pattern_ids_).size(),
                                           among(detections_.quotient, pattern_ids_).size());
    if (projected > 0) return;
    if (countRead(pattern_.family, mirrored(photographs_.pattern), pattern_ids_) >= kTelling) {
      fault(
          "the projected pattern is mirrored: set the projector to front projection (it is set "
          "to rear projection)");
      return;
    }
    for (const std::string& family : kTagFamilies) {
      if (family == pattern_.family) continue;
      if (countRead(family, photographs_.pattern, pattern_ids_) >= kTelling) {
        fault("the projected tags are of the family " + family + ", the layout says " +
              pattern_.family + ": show the pattern that the layout file belongs to");
        return;
      }
    }
    const std::string exposure = badExposure(photographs_.pattern);
    fault("no projected tag was read: " +
          (exposure.empty() ? "hold the board into the projector's light, focus the projector, and "
                              "darken the room if its light is faint"
                            : exposure));
  }

  const Photographs& photographs_;
  const ViewDetections& detections_;
  const Board& board_;
  const Pattern& pattern_;
  std::set<int> board_ids_, pattern_ids_, unknown_;
  bool has_plain_;
  const Picture& unlit_;  ///< picture in which the print is read
  const Tags& read_unlit_;
  ViewFaults result_;
};

}  // namespace

ViewFaults viewFaults(const Photographs& photographs, const ViewDetections& detections,
                      const Board& board, const Pattern& pattern) {
  return Judge(photographs, detections, board, pattern).judge();
}

}  // namespace afterglow::calib

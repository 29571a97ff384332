#include "calib/guide/board_watch.hpp"

#include "calib/detection/tag_detector.hpp"

namespace afterglow::calib {
namespace {

constexpr int kWidePicture = 1000;  // px; from here on half the resolution shows the tags as well
constexpr std::size_t kLevelStep = 7;

template <typename Target>
std::set<int> idsOf(const Target& target) {
  std::set<int> ids;
  for (const Tag& tag : target.tags) ids.insert(tag.id);
  return ids;
}

double meanLevel(const Picture& picture) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < picture.pixels.size(); i += kLevelStep) {
    sum += picture.pixels[i];
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

BoardWatch::BoardWatch(const Board& board, const Pattern& pattern, int picture_width)
    : board_ids_(idsOf(board)), pattern_ids_(idsOf(pattern)) {
  const double decimation = picture_width >= kWidePicture ? 2 : 1;
  detector_ = std::make_unique<TagDetector>(board.family, decimation);
  if (pattern.family != board.family) {
    pattern_detector_ = std::make_unique<TagDetector>(pattern.family, decimation);
  }
}

BoardWatch::~BoardWatch() = default;

WatchedFrame BoardWatch::look(const Picture& picture, std::int64_t stamp_ns) const {
  WatchedFrame frame;
  frame.stamp_ns = stamp_ns;
  frame.mean_level = meanLevel(picture);
  const auto isProjected = [&](const Tag& tag) { return pattern_ids_.count(tag.id) > 0; };
  for (const DetectedTag& tag : detector_->detect(picture)) {
    if (board_ids_.count(tag.id) > 0) {
      frame.board.push_back(tag);
    } else if (!pattern_detector_ && isProjected(tag)) {
      ++frame.pattern_tags;
    } else if (!isProjected(tag) && tag.hamming == 0) {  // corrected bits: no tag at all, perhaps
      frame.unknown.insert(tag.id);
    }
  }
  if (!pattern_detector_) return frame;
  for (const DetectedTag& tag : pattern_detector_->detect(picture)) {
    if (isProjected(tag)) ++frame.pattern_tags;
  }
  return frame;
}

}  // namespace afterglow::calib

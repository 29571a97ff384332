#include "calib/guide/view_builder.hpp"

#include <utility>

#include "calib/detection/tag_detector.hpp"

namespace afterglow::calib {
namespace {

constexpr int kWideImage = 1000;  // px; from here on half the resolution shows the tags as well
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

ViewBuilder::ViewBuilder(const Board& board, const Pattern& pattern, const Lens& camera)
    : board_(board),
      pattern_(pattern),
      camera_(camera),
      reader_(board, pattern, camera),
      board_ids_(idsOf(board)),
      pattern_ids_(idsOf(pattern)) {
  const double decimation = camera.width >= kWideImage ? 2 : 1;
  detector_ = std::make_unique<TagDetector>(board.family, decimation);
  if (pattern.family != board.family) {
    pattern_detector_ = std::make_unique<TagDetector>(pattern.family, decimation);
  }
}

ViewBuilder::~ViewBuilder() = default;

WatchedImage ViewBuilder::look(const Picture& picture, std::int64_t stamp_ns) const {
  WatchedImage image;
  image.stamp_ns = stamp_ns;
  image.mean_level = meanLevel(picture);
  const auto isProjected = [&](const Tag& tag) { return pattern_ids_.count(tag.id) > 0; };
  for (const DetectedTag& tag : detector_->detect(picture)) {
    if (board_ids_.count(tag.id) > 0) {
      image.board.push_back(tag);
    } else if (!pattern_detector_ && isProjected(tag)) {
      ++image.pattern_tags;
    } else if (!isProjected(tag) && tag.hamming == 0) {  // with corrected bits it may be no tag
      image.unknown.insert(tag.id);
    }
  }
  if (!pattern_detector_) return image;
  for (const DetectedTag& tag : pattern_detector_->detect(picture)) {
    if (isProjected(tag)) ++image.pattern_tags;
  }
  return image;
}

void ViewBuilder::keep(TakerAnswer::Keep kind, const std::string& view_name, Picture picture) {
  photographs_.name = view_name;
  if (kind == TakerAnswer::Keep::Pattern) {
    photographs_.pattern = std::move(picture);
  } else if (kind == TakerAnswer::Keep::Plain) {
    photographs_.plain = std::move(picture);
  }
}

View ViewBuilder::read() const { return reader_.observe(photographs_); }

ViewCheck ViewBuilder::check(const View& view, const Calibration& calibration) const {
  const View again = reader_.observeAgain(view, photographs_, calibration.estimate.projector);
  return checkView(again, board_, pattern_, calibration.camera, calibration.estimate);
}

}  // namespace afterglow::calib

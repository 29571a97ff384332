#include "calib/guide/view_taker.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/detection/board_pose.hpp"
#include "calib/detection/tag_detector.hpp"

namespace afterglow::calib {
namespace {

using Lack = TakerAnswer::Lack;

TakerAnswer lacking(Lack lack) {
  TakerAnswer answer;
  answer.lack = lack;
  return answer;
}

/// Root mean square of the movement of the corners that both images have, px. Empty if they share
/// fewer than `fewest` tags.
std::optional<double> movement(const std::vector<Tag>& first, const std::vector<Tag>& second,
                               std::size_t fewest) {
  std::size_t shared = 0;
  double sum = 0;
  for (const Tag& tag : first) {
    const auto same = std::find_if(second.begin(), second.end(),
                                   [&](const Tag& other) { return other.id == tag.id; });
    if (same == second.end()) continue;
    ++shared;
    for (std::size_t i = 0; i < 4; ++i) sum += (same->corners[i] - tag.corners[i]).squaredNorm();
  }
  if (shared == 0 || shared < fewest) return std::nullopt;
  return std::sqrt(sum / (4 * static_cast<double>(shared)));
}

}  // namespace

ViewTaker::ViewTaker(Board board, const Lens& camera, TakerOptions options)
    : board_(std::move(board)), camera_(camera), options_(options) {}

void ViewTaker::reset() {
  step_ = Step::Watch;
  is_forced_ = false;
  recent_.clear();
  T_camera_board_.reset();
}

TakerAnswer ViewTaker::see(const WatchedImage& image,
                           const std::vector<Rigid<Camera, Surface>>& taken) {
  if (image.stamp_ns < last_stamp_ns_ - options_.patience_ns) reset();  // another clock
  const bool is_late = image.stamp_ns < last_stamp_ns_ && step_ != Step::Watch;
  last_stamp_ns_ = image.stamp_ns;
  TakerAnswer answer;
  if (is_late) {
    answer.show = step_ == Step::AwaitPattern ? Shown::Pattern : Shown::Plain;
  } else if (step_ == Step::Watch) {
    answer = watch(image, taken);
  } else if (step_ == Step::AwaitPattern) {
    answer = awaitPattern(image);
  } else {
    answer = awaitPlain(image);
  }
  if (!answer.T_camera_board) answer.T_camera_board = T_camera_board_;
  return answer;
}

// ------------------------------------------------------------------------------------- watching

TakerAnswer ViewTaker::watch(const WatchedImage& image,
                             const std::vector<Rigid<Camera, Surface>>& taken) {
  T_camera_board_.reset();
  if (image.pattern_tags > 0) return lacking(Lack::Light);
  const bool is_in_view = image.board.size() >= options_.fewest_board_tags;
  if (is_in_view) T_camera_board_ = poseOf(image);
  if (!T_camera_board_) {
    recent_.clear();
    return lacking(image.board.empty() ? Lack::Board : Lack::WholeBoard);
  }
  if (!recent_.empty() && image.stamp_ns <= recent_.back().stamp_ns) recent_.clear();
  recent_.push_back(image);
  // One image that is older than still_ns stays, so that the window spans all of it.
  while (recent_.size() > 1 && recent_[1].stamp_ns <= image.stamp_ns - options_.still_ns) {
    recent_.pop_front();
  }
  if (!is_forced_) {
    if (!isNew(*T_camera_board_, taken)) return lacking(Lack::News);
    if (!isStill()) return lacking(Lack::Stillness);
  }
  is_forced_ = false;
  before_ = image;
  await(Step::AwaitPattern, image.stamp_ns);
  TakerAnswer answer;
  answer.show = Shown::Pattern;
  return answer;
}

std::optional<Rigid<Camera, Surface>> ViewTaker::poseOf(const WatchedImage& image) const {
  const auto pose = boardPose(image.board, board_.tags, camera_);
  if (!pose) return std::nullopt;
  return pose->T_camera_board;
}

bool ViewTaker::isStill() const {
  const WatchedImage& newest = recent_.back();
  const bool is_long = recent_.front().stamp_ns <= newest.stamp_ns - options_.still_ns;
  if (!is_long || recent_.size() < options_.still_images) return false;
  return std::all_of(recent_.begin(), recent_.end(), [&](const WatchedImage& image) {
    const auto moved = movement(image.board, newest.board, options_.fewest_board_tags);
    return moved && *moved < options_.still_px;
  });
}

bool ViewTaker::isNew(const Rigid<Camera, Surface>& T_camera_board,
                      const std::vector<Rigid<Camera, Surface>>& taken) const {
  const Eigen::Isometry3d& now = T_camera_board.matrix();
  return std::none_of(taken.begin(), taken.end(), [&](const Rigid<Camera, Surface>& other) {
    const Eigen::Isometry3d& then = other.matrix();
    const double turn =
        std::acos(std::clamp(now.linear().col(2).dot(then.linear().col(2)), -1.0, 1.0));
    const double shift = (now.translation() - then.translation()).norm();
    return turn < options_.new_turn_rad && shift < options_.new_shift * then.translation().norm();
  });
}

// ------------------------------------------------------------------------------------- taking

void ViewTaker::await(Step step, std::int64_t now_ns) {
  step_ = step;
  awaited_since_ns_ = now_ns;
  right_images_ = 0;
}

bool ViewTaker::isSettled(const WatchedImage& image, bool is_right) {
  const bool is_steady = std::abs(image.mean_level - last_level_) < options_.settled_levels;
  last_level_ = image.mean_level;
  if (!is_right) {
    right_images_ = 0;
  } else if (right_images_ == 0 || is_steady) {
    ++right_images_;
  } else {
    right_images_ = 1;  // the camera's exposure still follows the light
  }
  return right_images_ > options_.settle_images;
}

TakerAnswer ViewTaker::giveUp(const std::string& reason) {
  reset();
  TakerAnswer answer;
  answer.discarded = reason;
  return answer;
}

TakerAnswer ViewTaker::awaitPattern(const WatchedImage& image) {
  TakerAnswer answer;
  answer.show = Shown::Pattern;
  if (isSettled(image, image.pattern_tags >= options_.fewest_pattern_tags)) {
    answer.keep = TakerAnswer::Keep::Pattern;
    answer.show = Shown::Plain;
    await(Step::AwaitPlain, image.stamp_ns);
  } else if (image.stamp_ns - awaited_since_ns_ > options_.patience_ns) {
    return giveUp(
        "the camera does not see the pattern: hold the board in the projector's light "
        "and check that the projector shows the pattern sharply");
  }
  return answer;
}

TakerAnswer ViewTaker::awaitPlain(const WatchedImage& image) {
  if (isSettled(image, image.pattern_tags == 0)) {
    const auto moved = movement(before_.board, image.board, options_.fewest_board_tags);
    if (!moved) {
      return giveUp(
          "the board left the picture while it was photographed: hold it until the "
          "view is taken");
    }
    if (*moved >= options_.still_px) {
      return giveUp(
          "the board moved while it was photographed: hold it still, or lean it "
          "against something");
    }
    TakerAnswer answer;
    answer.keep = TakerAnswer::Keep::Plain;
    answer.is_complete = true;
    answer.T_camera_board = poseOf(image);
    reset();
    return answer;
  }
  if (image.stamp_ns - awaited_since_ns_ > options_.patience_ns) {
    return giveUp(
        "the camera goes on showing the pattern although plain gray is projected: does "
        "it repeat old frames, or does the projector show something else?");
  }
  return {};
}

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

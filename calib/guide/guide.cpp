#include "calib/guide/guide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace afterglow::calib {
namespace {

using Poses = std::vector<Rigid<Camera, Surface>>;

constexpr double kTilted = 0.21;      // rad, 12 degrees: what one view in each direction has
constexpr double kParallel = 0.26;    // rad, 15 degrees
constexpr double kDepthRange = 1.25;  // farthest to nearest board
constexpr double kCovered = 0.35;     // of a ninth of the picture

double distance(const Rigid<Camera, Surface>& pose) { return pose.matrix().translation().norm(); }

std::vector<std::string> missingTilts(const Poses& taken) {
  struct Direction {
    const char* name;
    Eigen::Vector2d axis;
  };
  const std::array<Direction, 4> directions = {{{"to the left", {-1, 0}},
                                                {"to the right", {1, 0}},
                                                {"upwards", {0, -1}},
                                                {"downwards", {0, 1}}}};
  std::vector<std::string> missing;
  for (const Direction& direction : directions) {
    const bool is_there = std::any_of(taken.begin(), taken.end(), [&](const auto& pose) {
      return boardTilt(pose).dot(direction.axis) > kTilted;
    });
    if (!is_there) missing.push_back(std::string("tilt it more ") + direction.name);
  }
  return missing;
}

std::string ninthText(const PictureNinth& ninth) {
  const auto [row, column] = ninth;
  if (row == 1 && column == 1) return "hold it in the middle of the light";
  static const char* const kRows[] = {"further up", "", "further down"};
  static const char* const kColumns[] = {" on the left of the light", " in the light",
                                         " on the right of the light"};
  const std::string height = row == 1 ? "further out" : kRows[row];
  return "hold it " + height + kColumns[column];
}

std::vector<std::string> placeTexts(const Coverage& coverage) {
  std::vector<std::string> texts;
  for (const PictureNinth& ninth : missingPlaces(coverage)) texts.push_back(ninthText(ninth));
  return texts;
}

/// The shorter way from the board's present distance, in steps that a person can follow.
std::vector<std::string> missingDepth(const Poses& taken,
                                      const std::optional<Rigid<Camera, Surface>>& now) {
  if (taken.empty()) return {};
  const auto closer = [](const auto& a, const auto& b) { return distance(a) < distance(b); };
  const auto [nearest, farthest] = std::minmax_element(taken.begin(), taken.end(), closer);
  if (distance(*farthest) >= kDepthRange * distance(*nearest)) return {};
  const double here = distance(now ? *now : taken.back());
  const double to_near = here - distance(*farthest) / kDepthRange;
  const double to_far = kDepthRange * distance(*nearest) - here;
  const bool comes_closer = to_near <= to_far;
  const double way = std::max(0.0, comes_closer ? to_near : to_far);
  const long centimeters = std::max(10L, 10 * std::lround(std::ceil(way * 10)));
  return {comes_closer ? "come " + std::to_string(centimeters) + " cm closer"
                       : "go " + std::to_string(centimeters) + " cm further back"};
}

}  // namespace

Eigen::Vector2d boardTilt(const Rigid<Camera, Surface>& T_camera_board) {
  const Eigen::Vector3d normal = T_camera_board.matrix().linear().col(2);
  const Eigen::Vector3d to_camera = -T_camera_board.matrix().translation().normalized();
  const Eigen::Vector3d right = (Eigen::Vector3d::UnitX() - to_camera.x() * to_camera).normalized();
  const Eigen::Vector3d down = right.cross(to_camera);
  const auto angle = [](double sine) { return std::asin(std::clamp(sine, -1.0, 1.0)); };
  return {angle(normal.dot(right)), angle(normal.dot(down))};
}

bool areParallel(const Poses& taken) {
  for (std::size_t i = 0; i < taken.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double cosine =
          taken[i].matrix().linear().col(2).dot(taken[j].matrix().linear().col(2));
      if (std::acos(std::clamp(cosine, -1.0, 1.0)) > kParallel) return false;
    }
  }
  return true;
}

std::vector<PictureNinth> missingPlaces(const Coverage& coverage) {
  constexpr int kSide = PictureNinth::kSide;
  std::vector<std::pair<double, PictureNinth>> missing;
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) {
      int lit = 0, all = 0;
      for (int y = row * Coverage::kRows / kSide; y < (row + 1) * Coverage::kRows / kSide; ++y) {
        for (int x = column * Coverage::kColumns / kSide;
             x < (column + 1) * Coverage::kColumns / kSide; ++x) {
          ++all;
          lit += coverage.corners[static_cast<std::size_t>(y * Coverage::kColumns + x)] > 0;
        }
      }
      const double share = static_cast<double>(lit) / all;
      if (share < kCovered) missing.push_back({share, {row, column}});
    }
  }
  std::stable_sort(missing.begin(), missing.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<PictureNinth> ninths;
  for (const auto& [share, ninth] : missing) ninths.push_back(ninth);
  return ninths;
}

std::vector<std::string> adviceFor(const Poses& taken, const Coverage& coverage,
                                   const std::optional<Rigid<Camera, Surface>>& now) {
  if (taken.empty()) return {"hold the board in the light, where the camera sees all of it"};
  std::vector<std::string> all;
  if (taken.size() >= 2 && areParallel(taken)) {
    all.push_back("turn it: all boards were parallel so far");
  }
  const std::vector<std::string> tilts = missingTilts(taken), places = placeTexts(coverage);
  const std::vector<std::string> depth = missingDepth(taken, now);
  // In turns, so that advice that cannot be followed does not hide the other advice.
  for (std::size_t i = 0; i < std::max({tilts.size(), places.size(), depth.size()}); ++i) {
    for (const auto* list : {&tilts, &places, &depth}) {
      if (i < list->size()) all.push_back((*list)[i]);
    }
  }
  return all;
}

namespace {

constexpr std::size_t kFewestProjected = 2;  // tags of the pattern on the board
constexpr int kMoreViews = 3;                // after a refusal
// A check this much above what was promised is not chance: one view's error varies by half.
constexpr double kSuspicious = 3, kSuspicious_mm = 1;

std::string millimeters(double mm) { return fmt::format("{:.2f} mm", mm); }

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::int64_t kWrittenAfter = 400 * kMillisecond;  // while the board moves, advice changes
constexpr std::int64_t kPause = 4000 * kMillisecond;        // a sentence, and time to act on it
constexpr std::int64_t kRepeatedAfter = 15000 * kMillisecond;

}  // namespace

std::string phaseName(GuidePhase phase) {
  static const char* const kNames[] = {"idle",      "collecting", "solving",
                                       "verifying", "timing",     "done"};
  return kNames[static_cast<int>(phase)];
}

Guide::Guide(Board board, Pattern pattern, const Lens& camera, GuideOptions options)
    : board_(std::move(board)),
      pattern_(std::move(pattern)),
      options_(options),
      taker_(board_, camera, options.taker),
      views_wanted_(options.views) {}

// ------------------------------------------------------------------------------------ commands

void Guide::start() {
  views_.clear();
  poses_.clear();
  coverage_ = {};
  views_wanted_ = options_.views;
  discarded_ = named_ = 0;
  tell("calibration begins: hold the board in the light, where the camera sees all of it");
  collect();
}

void Guide::collect() {
  taker_.reset();
  wanted_ = Shown::Plain;
  phase_ = GuidePhase::Collecting;
}

void Guide::stop() {
  if (phase_ == GuidePhase::Idle) return;
  taker_.reset();
  phase_ = GuidePhase::Idle;
  tell("calibration stopped");
}

bool Guide::forceView() {
  if (phase_ != GuidePhase::Collecting && phase_ != GuidePhase::Verifying) return false;
  taker_.force();
  return true;
}

bool Guide::solveNow() {
  if (views_.empty()) return false;
  if (phase_ == GuidePhase::Solving) return false;
  taker_.reset();
  phase_ = GuidePhase::Solving;
  tell("solving from " + std::to_string(views_.size()) + " views");
  return true;
}

std::optional<std::string> Guide::discardLast() {
  if (views_.empty() || phase_ != GuidePhase::Collecting) return std::nullopt;
  const std::string name = views_.back().name;
  views_.pop_back();
  poses_.pop_back();
  coverage_ = coverageOf(views_, pattern_);
  tell(name + " is discarded: " + progress());
  return name;
}

// -------------------------------------------------------------------------------------- watching

TakerAnswer Guide::see(const WatchedImage& image) {
  now_ns_ = image.stamp_ns;
  TakerAnswer answer;
  answer.show = shown();
  if (phase_ != GuidePhase::Collecting && phase_ != GuidePhase::Verifying) return answer;
  answer = taker_.see(image, poses_);
  wanted_ = answer.show;
  if (!answer.discarded.empty()) {
    discard(answer.discarded);
  } else if (answer.show == Shown::Plain && answer.keep == TakerAnswer::Keep::Nothing) {
    advise(answer, image);
  }
  return answer;
}

void Guide::advise(const TakerAnswer& answer, const WatchedImage& image) {
  const std::string text = adviceText(answer, image);
  if (text.empty()) return;
  const bool is_in_vain = prompter_.advise(text, now_ns_);
  if (is_in_vain) ++turn_;
}

std::string Guide::adviceText(const TakerAnswer& answer, const WatchedImage& image) const {
  const std::string other = otherBoardText(image.unknown, board_);
  switch (answer.lack) {
    case TakerAnswer::Lack::Nothing:
      return "";
    case TakerAnswer::Lack::Light:
      return "wait: the camera still sees tags of the pattern, although plain gray is projected";
    case TakerAnswer::Lack::Board:
      if (!other.empty()) return other;
      return "show the board to the camera: it sees none of the printed tags";
    case TakerAnswer::Lack::WholeBoard:
      return "the camera sees too little of the board: bring all of it into the picture, face "
             "to the camera";
    case TakerAnswer::Lack::Stillness:
      return "hold it still";
    case TakerAnswer::Lack::News:
      break;
  }
  if (phase_ == GuidePhase::Verifying) return "for the check, hold it where it has not been yet";
  const auto all = adviceFor(poses_, coverage_, answer.T_camera_board);
  if (all.empty()) return "tilt it another way, or hold it in another place";
  // The most urgent first; in turns when it is not, or cannot be, followed.
  return all[(poses_.size() + turn_) % all.size()];
}

void Guide::discard(const std::string& reason) {
  ++discarded_;
  tell(reason);
}

bool Guide::addView(const View& view, const Rigid<Camera, Surface>& T_camera_board) {
  if (phase_ != GuidePhase::Collecting) return false;
  if (!view.faults.empty()) {
    discard("view discarded: " + view.faults.front());
    return false;
  }
  if (view.projected.size() < kFewestProjected) {
    discard("view discarded: only " + std::to_string(view.projected.size()) +
            " tags of the pattern lie on the board: hold it further into the light, or closer to "
            "the camera");
    return false;
  }
  views_.push_back(view);
  poses_.push_back(T_camera_board);
  coverage_ = coverageOf(views_, pattern_);
  ++named_;
  tell("view taken: " + progress());
  if (isEnough()) solveNow();
  return true;
}

bool Guide::isEnough() const {
  const int count = static_cast<int>(views_.size());
  if (count < views_wanted_) return false;
  const bool is_good = coverage_.share() >= options_.coverage && !areParallel(poses_);
  return is_good || count >= 2 * views_wanted_;  // some of the light may be out of reach
}

// -------------------------------------------------------------------------------------- results

void Guide::solved(const Calibration& calibration) {
  if (phase_ != GuidePhase::Solving) return;
  promised_mm_ = calibration.held_out_rms_mm;
  for (const ViewResult& view : calibration.views) {
    if (!view.is_used) tell(view.name + " was left out: " + view.reason);
  }
  for (const std::string& warning : calibration.warnings) tell(warning);
  tell("calibrated: a view that had no part in it is met to " + millimeters(promised_mm_) +
       ". For the check, hold the board where it has not been yet");
  collect();
  phase_ = GuidePhase::Verifying;
}

void Guide::refused(const std::vector<std::string>& reasons) {
  if (phase_ != GuidePhase::Solving) return;
  for (const std::string& reason : reasons) tell("cannot calibrate yet: " + reason);
  views_wanted_ = std::max(views_wanted_, static_cast<int>(views_.size()) + kMoreViews);
  collect();
}

void Guide::checked(const ErrorSummary& errors) {
  if (phase_ != GuidePhase::Verifying) return;
  if (errors.corners == 0) {
    discard("the check could not be measured: hold the board further into the light");
    return;
  }
  std::string text = "checked: the light is " + millimeters(errors.rms_mm) + " off, at worst " +
                     millimeters(errors.max_mm);
  if (errors.rms_mm > std::max(kSuspicious * promised_mm_, kSuspicious_mm)) {
    text += "; that is more than the calibration promised (" + millimeters(promised_mm_) +
            "): have camera or projector moved? Calibrate again";
  }
  tell(text);
  taker_.reset();
  phase_ = options_.times_delay ? GuidePhase::Timing : GuidePhase::Done;
  if (!options_.times_delay) return;
  tell(
      "now the projector's delay: for a minute or two its light goes on and off. Hold the board "
      "still in it, or let it fall on the floor, where the camera sees it");
}

void Guide::timed(const std::string& words) {
  if (phase_ != GuidePhase::Timing) return;
  tell(words);
  phase_ = GuidePhase::Done;
}

void Guide::tell(const std::string& text) { prompter_.tell(text, now_ns_); }

Shown Guide::shown() const {
  switch (phase_) {
    case GuidePhase::Collecting:
    case GuidePhase::Verifying:
      return wanted_;
    case GuidePhase::Solving:
      return Shown::Plain;
    case GuidePhase::Idle:
    case GuidePhase::Timing:
    case GuidePhase::Done:
      break;
  }
  return Shown::Black;
}

std::string Guide::nextName() const { return fmt::format("view_{:02}", named_); }

std::string Guide::progress() const {
  return std::to_string(views_.size()) + " of " + std::to_string(views_wanted_) +
         " views, coverage " + std::to_string(std::lround(100 * coverage_.share())) + " %";
}

void Prompter::tell(const std::string& text, std::int64_t now_ns) {
  const bool is_stale =
      text == told_ && now_ns >= told_at_ns_ && now_ns - told_at_ns_ < kRepeatedAfter;
  waiting_.push_back({text, !is_stale, false});
  if (!is_stale) {
    told_ = text;
    told_at_ns_ = spoken_at_ns_ = now_ns;
  }
  written_.clear();
  spoken_.clear();
}

bool Prompter::advise(const std::string& text, std::int64_t now_ns) {
  if (text != candidate_ || now_ns < candidate_since_ns_) {
    candidate_ = text;
    candidate_since_ns_ = now_ns;
  }
  if (now_ns < spoken_at_ns_) spoken_at_ns_ = now_ns;  // the stamps have jumped back
  if (now_ns - candidate_since_ns_ < kWrittenAfter) return false;
  const bool is_repeated = text == spoken_ && now_ns - spoken_at_ns_ >= kRepeatedAfter;
  const bool is_new = text != spoken_ && now_ns - spoken_at_ns_ >= kPause;
  if (is_new || is_repeated) {
    waiting_.push_back({text, true, true});
    written_ = spoken_ = text;
    spoken_at_ns_ = now_ns;
  } else if (text != written_) {
    waiting_.push_back({text, false, true});
    written_ = text;
  }
  return is_repeated;
}

std::vector<Utterance> Prompter::take() { return std::exchange(waiting_, {}); }

}  // namespace afterglow::calib

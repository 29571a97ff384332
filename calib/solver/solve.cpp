#include "calib/solver/solve.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <limits>
#include <mutex>

#include "calib/median.hpp"
#include "calib/parallel.hpp"
#include "calib/solver/cross_validation.hpp"
#include "calib/solver/linear_start.hpp"
#include "calib/solver/outcome.hpp"
#include "calib/solver/reach.hpp"
#include "calib/solver/refine.hpp"
#include "calib/solver/refusals.hpp"

namespace afterglow::calib {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
/// A view is spoilt if its middle error is this many times that of the views together.
constexpr double kSpoiltRatio = 5;
/// And at least so large: below, there is nothing to gain.
constexpr double kSpoiltLeast_px = 0.5;

/// Middle error of the view's projected tags, projector pixels.
double middleError(const ProjectorModel& model, const ViewEvidence& view) {
  std::vector<double> errors;
  for (const Sighting& tag : view.projected) {
    const double error = projectedError(model, view, tag).error.norm() / 2;
    errors.push_back(std::isfinite(error) ? error : kNever);
  }
  return median(errors, kNever);
}

std::vector<PosedView> posedViews(const std::vector<ViewEvidence>& views) {
  std::vector<PosedView> posed;
  for (const ViewEvidence& view : views) {
    if (!view.is_used) continue;
    PosedView one{view.name, view.T_camera_board, {}};
    for (const Sighting& tag : view.projected) {
      one.lit_px.insert(one.lit_px.end(), tag.target.begin(), tag.target.end());
    }
    posed.push_back(one);
  }
  return posed;
}

/// One run of the solver: the steps share the evidence, the model and who is told of progress.
class Solve {
 public:
  Solve(const std::vector<View>& views, const Board& board, const Pattern& pattern,
        const Lens& camera, const SolveOptions& options, const CalibrationProgress& progress)
      : observed_(views),
        board_(board),
        pattern_(pattern),
        options_(options),
        progress_(progress),
        views_(gatherEvidence(views, board, pattern, camera)) {
    model_.camera = camera;
  }

  /// Model and board poses, with spoilt views left out; refuses what cannot be solved.
  void solve() {
    say("starting", 0);
    refuseIf(printRefusals(board_, std::nullopt, options_.measured_ruler_m));
    refuseIf(viewRefusals(posedViews(views_), board_, pattern_));
    startLinearly();
    dropSpoiltViews();
    say("refining", 0.2);
    refineRounds(2);
    dropSpoiltViews();
    refuseIf(viewRefusals(posedViews(views_), board_, pattern_));
    refuseIf(pixelShapeRefusals(pixelShape(model_, views_), model_.projector));
    refuseIf(printRefusals(board_, printStretch(model_, views_), options_.measured_ruler_m));
    settings_.free_camera = options_.refine_camera;
    refineRounds(2);
    tryRational();
  }

  /// Without a look at print and pixels' shape: good enough a lens for reading the tags once more.
  void solveRoughly() {
    refuseIf(viewRefusals(posedViews(views_), board_, pattern_));
    startLinearly();
    dropSpoiltViews();
    refineRounds(1);
  }

  const Lens& projector() const { return model_.projector; }

  Calibration finish() {
    say("leaving out one view after the other", 0.5);
    std::vector<std::optional<HeldOut>> held_out =
        leaveOneOut(model_, views_, settings_, options_.threads);
    if (dropUnpredictedViews(held_out)) {
      refuseIf(viewRefusals(posedViews(views_), board_, pattern_));
      refineRounds(2);
      held_out = leaveOneOut(model_, views_, settings_, options_.threads);
    }
    say("measuring uncertainty", 0.8);
    Calibration calibration;
    ProjectorModel widened = model_;
    measureScales(widened, views_);
    widenScales(widened, views_);
    calibration.estimate = estimateOf(widened, views_, settings_);
    calibration.estimate.covariance *= jackknifeInflation(calibration.estimate, views_, held_out);
    calibration.camera = model_.camera;
    calibration.coverage = coverageOfUsed();
    for (std::size_t i = 0; i < views_.size(); ++i) {
      calibration.views.push_back(viewResult(model_, views_[i], held_out[i]));
    }
    setErrors(calibration, held_out);
    judge(calibration);
    say("done", 1);
    return calibration;
  }

 private:
  void say(const std::string& doing, double share) const {
    if (progress_) progress_(doing, share);
  }

  void refuseIf(const std::vector<std::string>& reasons) const {
    if (reasons.empty()) return;
    std::vector<ViewResult> results;
    for (const ViewEvidence& view : views_) results.push_back(viewResult(view));
    std::vector<std::string> all = reasons;
    const auto unused = std::count_if(views_.begin(), views_.end(),
                                      [](const ViewEvidence& view) { return !view.is_used; });
    // When most views are unusable, why is what people need to hear.
    if (2 * std::size_t(unused) > views_.size()) {
      const std::vector<std::string> why = whyUnused();
      all.insert(all.end(), why.begin(), why.end());
    }
    throw CalibrationRefused(all, results);
  }

  /// Views with one reason together: "view_00, view_03: none of ...".
  std::vector<std::string> whyUnused() const {
    std::vector<std::pair<std::string, std::string>> names_by_reason;
    for (const ViewEvidence& view : views_) {
      if (view.is_used) continue;
      const auto same = std::find_if(names_by_reason.begin(), names_by_reason.end(),
                                     [&](const auto& one) { return one.second == view.reason; });
      if (same == names_by_reason.end()) {
        names_by_reason.emplace_back(view.name, view.reason);
      } else {
        same->first += ", " + view.name;
      }
    }
    std::vector<std::string> lines;
    for (const auto& [names, reason] : names_by_reason) lines.push_back(names + ": " + reason);
    return lines;
  }

  void startLinearly() {
    const auto start = linearStart(views_, pattern_);
    if (!start) {
      refuseIf(
          {"no projector explains where the projected tags fall: is this the pattern that was "
           "shown, and are pictures and board of one session?"});
    }
    Eigen::Matrix3d K = start->K;
    K(0, 1) = 0;
    model_.projector = makeLens(pattern_.width, pattern_.height, K, {});
    model_.T_camera_projector = start->T_camera_projector;
    RefineSettings coarse;
    coarse.free_boards = false;
    coarse.robust_deviations = 2;
    for (int round = 0; round < 4; ++round) {
      measureScales(model_, views_);
      refine(model_, views_, coarse);
    }
  }

  void refineRounds(int rounds) {
    for (int round = 0; round < rounds; ++round) {
      measureScales(model_, views_);
      refine(model_, views_, settings_);
    }
  }

  void dropSpoiltViews() {
    std::vector<double> middles;
    for (const ViewEvidence& view : views_) {
      if (view.is_used) middles.push_back(middleError(model_, view));
    }
    const double limit = std::max(kSpoiltRatio * median(middles, kNever), kSpoiltLeast_px);
    for (ViewEvidence& view : views_) {
      if (!view.is_used) continue;
      const double error = middleError(model_, view);
      if (!(error > limit)) continue;
      leaveOut(view, error);
    }
  }

  void leaveOut(ViewEvidence& view, double error_px) const {
    char text[200];
    std::snprintf(text, sizeof text,
                  "its projected tags are %.1f px off what the other views say: did the board or "
                  "the camera move between its pictures, or is the board bent?",
                  std::min(error_px, 9999.0));
    view.is_used = false;
    view.reason = text;
  }

  bool dropUnpredictedViews(const std::vector<std::optional<HeldOut>>& held_out) {
    std::vector<double> errors;
    for (const auto& one : held_out) {
      if (one) errors.push_back(one->rms_px);
    }
    const double limit = std::max(kSpoiltRatio * median(errors, kNever), kSpoiltLeast_px);
    bool any = false;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (!held_out[i] || !(held_out[i]->rms_px > limit)) continue;
      leaveOut(views_[i], held_out[i]->rms_px);
      any = true;
    }
    return any;
  }

  /// Rational distortion, if the errors are much smaller with it: three more parameters always fit
  /// a little better, and extrapolate worse.
  void tryRational() {
    constexpr double kMuchSmaller = 0.85;
    ProjectorModel rational = model_;
    std::vector<ViewEvidence> views = views_;
    RefineSettings settings = settings_;
    settings.free_rational = true;
    refine(rational, views, settings);
    measureScales(model_, views_);
    measureScales(rational, views);
    if (!(rational.projected_scale < kMuchSmaller * model_.projected_scale)) return;
    model_ = rational;
    views_ = views;
    settings_ = settings;
    refineRounds(1);
  }

  Coverage coverageOfUsed() const {
    std::vector<View> used;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (views_[i].is_used) used.push_back(observed_[i]);
    }
    return coverageOf(used, pattern_);
  }

  void judge(Calibration& calibration) const {
    refuseIf(foldRefusals(calibration.estimate.projector));
    refuseIf(misfitRefusals(calibration.held_out_rms_px, calibration.estimate.projector));
    refuseIf(uncertaintyRefusals(calibration.estimate, posedViews(views_)));
    const Reach reach =
        reachOf(calibration.estimate, calibration.camera, pattern_, posedViews(views_));
    refuseIf(reachRefusals(reach));
    for (const std::string& warning : reachWarnings(reach)) calibration.warnings.push_back(warning);
    for (const ViewResult& view : calibration.views) {
      if (!view.is_used) calibration.warnings.push_back(view.name + " left out: " + view.reason);
    }
    if (settings_.free_rational) {
      calibration.warnings.push_back("the lens needed rational distortion (8 coefficients)");
    }
  }

  const std::vector<View>& observed_;
  const Board& board_;
  const Pattern& pattern_;
  SolveOptions options_;
  CalibrationProgress progress_;
  std::vector<ViewEvidence> views_;
  ProjectorModel model_;
  RefineSettings settings_;
};

/// Runs `read` on each photograph, a reader a thread, and says how many are done.
template <typename Read>
std::vector<View> readAll(std::size_t count, const std::string& doing, double from, double to,
                          const SolveOptions& options, const CalibrationProgress& progress,
                          const Read& read) {
  std::vector<View> views(count);
  std::mutex mutex;
  std::size_t done = 0;
  forEachIndex(count, options.threads, [&](std::size_t i) {
    views[i] = read(i);
    const std::lock_guard<std::mutex> lock(mutex);
    ++done;
    if (progress) progress(doing, from + (to - from) * double(done) / double(count));
  });
  return views;
}

}  // namespace

Calibration solveViews(const std::vector<View>& views, const Board& board, const Pattern& pattern,
                       const Lens& camera, const SolveOptions& options,
                       const CalibrationProgress& progress) {
  Solve solve(views, board, pattern, camera, options, progress);
  solve.solve();
  return solve.finish();
}

Calibration solvePhotographs(const std::vector<Photographs>& photographs, const Board& board,
                             const Pattern& pattern, const Lens& camera,
                             const SolveOptions& options, const CalibrationProgress& progress) {
  const ViewReader reader(board, pattern, camera);
  const std::vector<View> first =
      readAll(photographs.size(), "reading tags", 0, 0.5, options, progress,
              [&](std::size_t i) { return reader.glance(photographs[i]); });
  Solve rough(first, board, pattern, camera, options, {});
  rough.solveRoughly();
  const Lens projector = rough.projector();
  const std::vector<View> second = readAll(
      photographs.size(), "reading tags through the projector's lens", 0.55, 0.8, options, progress,
      [&](std::size_t i) { return reader.observeAgain(first[i], photographs[i], projector); });
  const CalibrationProgress last = [&](const std::string& doing, double share) {
    if (progress) progress(doing, 0.8 + 0.2 * share);
  };
  return solveViews(second, board, pattern, camera, options, last);
}

}  // namespace afterglow::calib

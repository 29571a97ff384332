#include "calib/solver/solve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

#include "calib/median.hpp"
#include "calib/parallel.hpp"
#include "calib/solver/beam.hpp"
#include "calib/solver/cross_validation.hpp"
#include "calib/solver/linear_start.hpp"
#include "calib/solver/outcome.hpp"
#include "calib/solver/reach.hpp"
#include "calib/solver/refine.hpp"
#include "calib/solver/refusals.hpp"

namespace afterglow::calib {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
/// A view is spoiled if its median error is this many times that of all views.
constexpr double kSpoiledRatio = 5;
/// And at least this large.
constexpr double kSpoiledLeast_px = 0.5;

/// Median error of the view's projected tags, projector pixels.
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

/// A run of the solver: its steps share the evidence, the model and the progress callback.
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
    model_.camera = model_.camera_info = camera;
    model_.shape = BoardShape::flat(board);
    model_.start = options.start;
    is_spoiled_.resize(views_.size(), false);
  }

  /// Model and board poses, with spoiled views left out; refuses what cannot be solved.
  void solve() {
    say("starting", 0);
    refuseIf(printRefusals(board_, std::nullopt, options_.measured_ruler_m));
    refuseUnfitViews();
    begin();
    dropSpoiledViews();
    say("refining", 0.2);
    const bool free_camera = options_.camera_use != CameraUse::Hold;
    settings_.free_camera = free_camera;
    settings_.free_shape = true;
    refineRounds(2);
    if (model_.start) refuseIf(driftRefusals(model_.start->projector, model_.projector));
    dropSpoiledViews();
    refuseUnfitViews();
    refuseIf(shapeRefusals(model_.shape));
    refuseIf(printRefusals(board_, printStretch(model_, views_, free_camera),
                           options_.measured_ruler_m));
    refuseIf(pixelShapeRefusals(pixelShape(model_, views_, free_camera), model_.projector));
    settleCamera();
  }

  /// Solves without checks of print and pixel shape: a lens good enough to read the tags once more.
  void solveRoughly() {
    refuseUnfitViews();
    begin();
    dropSpoiledViews();
    refineRounds(1);
  }

  const Lens& projector() const { return model_.projector; }

  Calibration finish() {
    say("leaving out one view after the other", 0.5);
    std::vector<std::optional<HeldOut>> held_out = leaveOut();
    if (dropUnpredictedViews(held_out)) {
      refuseUnfitViews();
      refineRounds(2);
      held_out = leaveOut();
    }
    say("measuring uncertainty", 0.8);
    Calibration calibration;
    ProjectorModel widened = model_;
    measureScales(widened, views_);
    widenScales(widened, views_);
    setEstimate(widened, calibration);
    calibration.camera = model_.camera;
    calibration.camera_info = model_.camera_info;
    calibration.camera_change = camera_change_;
    calibration.board_shape = model_.shape;
    calibration.predicted_mm = predictedError(calibration.estimate, posedViews(views_)).mm;
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
    // When most views are unusable, people need the reasons.
    if (2 * std::size_t(unused) > views_.size()) {
      const auto why = whyUnused();
      const bool is_one_reason =
          std::size_t(unused) == views_.size() && 2 * why.front().names.size() >= views_.size();
      if (is_one_reason) {
        const bool is_every = why.front().names.size() == views_.size();
        all = {(is_every ? "every view: " : "most views: ") + why.front().reason};
      } else {
        for (const Unused& one : why) all.push_back(one.text());
      }
    }
    throw CalibrationRefused(all, results);
  }

  /// Views that are not used for one reason.
  struct Unused {
    std::string reason;
    std::vector<std::string> names;

    /// "view_00, view_03: none of ..."
    std::string text() const {
      return fmt::format("{}: {}", fmt::join(names, ", "), reason);
    }
  };

  /// The most common reason first.
  std::vector<Unused> whyUnused() const {
    std::vector<Unused> why;
    for (const ViewEvidence& view : views_) {
      if (view.is_used) continue;
      const auto same = std::find_if(why.begin(), why.end(),
                                     [&](const Unused& one) { return one.reason == view.reason; });
      if (same == why.end()) {
        why.push_back({view.reason, {view.name}});
      } else {
        same->names.push_back(view.name);
      }
    }
    std::stable_sort(why.begin(), why.end(), [](const Unused& one, const Unused& other) {
      return one.names.size() > other.names.size();
    });
    return why;
  }

  void refuseUnfitViews() const {
    refuseIf(model_.start ? refiningRefusals(posedViews(views_), board_)
                          : viewRefusals(posedViews(views_), board_, pattern_));
  }

  void begin() {
    if (model_.start) {
      model_.projector = model_.start->projector;
      model_.T_camera_projector = model_.start->T_camera_projector;
      const auto& D = model_.projector.D;
      settings_.free_rational = D[5] != 0 || D[6] != 0 || D[7] != 0;
    } else {
      startLinearly();
    }
    RefineSettings coarse;
    coarse.free_boards = false;
    coarse.robust_deviations = 2;
    for (int round = 0; round < 4; ++round) {
      measureScales(model_, views_);
      refine(model_, views_, coarse);
    }
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
  }

  void refineRounds(int rounds) {
    for (int round = 0; round < rounds; ++round) {
      measureScales(model_, views_);
      refine(model_, views_, settings_);
    }
  }

  void dropSpoiledViews() {
    std::vector<double> middles;
    for (const ViewEvidence& view : views_) {
      if (view.is_used) middles.push_back(middleError(model_, view));
    }
    const double limit = std::max(kSpoiledRatio * median(middles, kNever), kSpoiledLeast_px);
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (!views_[i].is_used) continue;
      const double error = middleError(model_, views_[i]);
      if (!(error > limit)) continue;
      leaveOut(views_[i], error);
      is_spoiled_[i] = true;
    }
  }

  void leaveOut(ViewEvidence& view, double error_px) const {
    view.is_used = false;
    view.reason = fmt::format(
        "its projected tags are {:.1f} px off what the other views say: did the board or the "
        "camera move between its pictures, or is the board bent?",
        std::min(error_px, 9999.0));
  }

  bool dropUnpredictedViews(const std::vector<std::optional<HeldOut>>& held_out) {
    std::vector<double> errors;
    for (const auto& one : held_out) {
      if (one) errors.push_back(one->rms_px);
    }
    const double limit = std::max(kSpoiledRatio * median(errors, kNever), kSpoiledLeast_px);
    bool any = false;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (!held_out[i] || !(held_out[i]->rms_px > limit)) continue;
      leaveOut(views_[i], held_out[i]->rms_px);
      any = true;
    }
    return any;
  }

  /// Keeps camera_info, or its distortion, unless the views contradict it: it may be exact, and
  /// more unknowns make the result less certain.
  void settleCamera() {
    const ProjectorModel model = model_;
    const std::vector<ViewEvidence> views = views_;
    const RefineSettings settings = settings_;
    settings_.free_camera = true;
    refineFully();
    camera_change_ = cameraChange(model_.camera_info, model_.camera,
                                  cameraCovariance(influenceOf(model_, views_, settings_)));
    const bool is_contradicted = camera_change_.isContradicted();
    const bool is_refined =
        options_.camera_use == CameraUse::Refine ||
        (options_.camera_use == CameraUse::RefineIfContradicted && is_contradicted);
    camera_change_.fate = is_refined                               ? CameraFate::Refined
                          : options_.camera_use == CameraUse::Hold ? CameraFate::Held
                                                                   : CameraFate::Agrees;
    refuseIf(cameraRefusals(model_.camera_info, camera_change_));
    if (is_refined && camera_change_.isDistortionContradicted()) return judgeSpoiledViewsAnew();
    model_ = model;
    views_ = views;
    settings_ = settings;
    seeThroughCameraInfo();
    settings_.free_camera = is_refined;
    settings_.free_camera_distortion = false;
    refineFully();
    if (!is_refined) return;
    judgeSpoiledViewsAnew();
    camera_change_.describe(model_.camera_info, model_.camera);
  }

  void seeThroughCameraInfo() {
    model_.camera = model_.camera_info;
    for (ViewEvidence& view : views_) setRays(view, model_.camera);
  }

  /// Judges views anew that were left out because they contradicted others when seen through the
  /// camera as given.
  void judgeSpoiledViewsAnew() {
    bool any = false;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (!is_spoiled_[i]) continue;
      is_spoiled_[i] = false;
      views_[i].is_used = any = true;
      views_[i].reason.clear();
      refineBoardPose(model_, views_[i]);
    }
    if (!any) return;
    dropSpoiledViews();
    refineRounds(2);
  }

  void refineFully() {
    refineRounds(2);
    if (!model_.start) tryRational();
  }

  std::vector<std::optional<HeldOut>> leaveOut() {
    return leaveOneOut(model_, views_, influenceOf(model_, views_, settings_), options_.threads);
  }

  /// Sets the estimate with the covariance that the uncertainties of camera and board are part of:
  /// also that of a camera_info which the views just do not contradict; unless it was held.
  void setEstimate(const ProjectorModel& widened, Calibration& calibration) {
    RefineSettings held = settings_, open = settings_;
    held.free_camera = false;
    open.free_camera = camera_change_.fate != CameraFate::Held;
    open.free_camera_distortion = true;
    held.free_shape = open.free_shape = true;
    const Influence influence = influenceOf(widened, views_, open);
    const ProjectorEstimate plain = estimateOf(widened, influence);
    const Beam beam(plain, model_.camera);
    const double dispersion = influence.dispersion(beam.importance());
    through_known_camera_ =
        estimateOf(widened, influenceOf(widened, views_, held), dispersion);
    calibration.estimate = estimateOf(widened, influence, dispersion);
    const auto used = std::count_if(views_.begin(), views_.end(),
                                    [](const ViewEvidence& view) { return view.is_used; });
    calibration.light = beam.errors(calibration.estimate, plain, static_cast<int>(used));
    calibration.print_mm_per_permille = model_.T_camera_projector.matrix().translation().norm();
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
    // More views do not help when the camera is not known well.
    refuseIf(uncertaintyRefusals(through_known_camera_, posedViews(views_)));
    if (!model_.start) judgeReach(calibration);
    for (const ViewResult& view : calibration.views) {
      if (!view.is_used) calibration.warnings.push_back(view.name + " left out: " + view.reason);
    }
    const std::string unsure_size = unsureSizeText(board_);
    if (!unsure_size.empty()) calibration.warnings.push_back(unsure_size);
    for (const std::string& warning : shapeWarnings(model_.shape)) {
      calibration.warnings.push_back(warning);
    }
    for (const std::string& warning : cameraWarnings(model_.camera_info, camera_change_)) {
      calibration.warnings.push_back(warning);
    }
    if (settings_.free_rational) {
      calibration.warnings.push_back("the lens needed rational distortion (8 coefficients)");
    }
  }

  void judgeReach(Calibration& calibration) const {
    const Reach reach =
        reachOf(calibration.estimate, calibration.camera, pattern_, posedViews(views_));
    refuseIf(reachRefusals(reach));
    for (const std::string& warning : reachWarnings(reach)) calibration.warnings.push_back(warning);
  }

  const std::vector<View>& observed_;
  const Board& board_;
  const Pattern& pattern_;
  SolveOptions options_;
  CalibrationProgress progress_;
  std::vector<ViewEvidence> views_;
  std::vector<bool> is_spoiled_;  ///< left out by dropSpoiledViews
  ProjectorModel model_;
  RefineSettings settings_;
  CameraChange camera_change_;
  ProjectorEstimate through_known_camera_;
};

/// Runs `read` on each photograph, with one reader for each thread, and reports the progress.
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

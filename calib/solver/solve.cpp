#include "calib/solver/solve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "calib/median.hpp"
#include "calib/parallel.hpp"
#include "calib/solver/influence.hpp"
#include "calib/solver/linear_start.hpp"
#include "calib/solver/outcome.hpp"
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

/// The material and the options of a calibration.
struct Task {
  const std::vector<View>& views;
  const Board& board;
  const Pattern& pattern;
  const SolveOptions& options;
  const CalibrationProgress& progress;

  void say(const std::string& doing, double share) const {
    if (progress) progress(doing, share);
  }
};

/// The estimates so far, and the views that they are made from. A step takes a state and returns a
/// better one.
struct State {
  ProjectorModel model;
  std::vector<ViewEvidence> views;
  std::vector<bool> is_spoiled;  ///< views that withoutSpoiledViews() leaves out
  RefineSettings settings;

  Influence influence() { return influenceOf(model, views, settings); }
};

State stateOf(const Task& task, const Lens& camera) {
  State state;
  state.views = gatherEvidence(task.views, task.board, task.pattern, camera);
  state.is_spoiled.resize(state.views.size(), false);
  state.model.camera = state.model.camera_info = camera;
  state.model.shape = BoardShape::flat(task.board);
  state.model.start = task.options.start;
  return state;
}

// ---------------------------------------------------------------------------------------- refusals

/// Views that are left out for the same reason.
struct Unused {
  std::string reason;
  std::vector<std::string> names;

  /// "view_00, view_03: none of ..."
  std::string text() const { return fmt::format("{}: {}", fmt::join(names, ", "), reason); }
};

/// Returns the reasons, the most common one first.
std::vector<Unused> whyUnused(const std::vector<ViewEvidence>& views) {
  std::vector<Unused> why;
  for (const ViewEvidence& view : views) {
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

/// Throws if there are reasons. When most views are unusable, people need those reasons, too.
void refuseIf(std::vector<std::string> reasons, const std::vector<ViewEvidence>& views) {
  if (reasons.empty()) return;
  std::vector<ViewResult> results;
  for (const ViewEvidence& view : views) results.push_back(viewResult(view));
  const auto unused = static_cast<std::size_t>(std::count_if(
      views.begin(), views.end(), [](const ViewEvidence& view) { return !view.is_used; }));
  if (2 * unused > views.size()) {
    const auto why = whyUnused(views);
    if (unused == views.size() && 2 * why.front().names.size() >= views.size()) {
      const bool is_every = why.front().names.size() == views.size();
      reasons = {(is_every ? "every view: " : "most views: ") + why.front().reason};
    } else {
      for (const Unused& one : why) reasons.push_back(one.text());
    }
  }
  throw CalibrationRefused(reasons, results);
}

void refuseUnfitViews(const Task& task, const State& state) {
  const std::vector<PosedView> posed = posedViews(state.views);
  refuseIf(task.options.start ? refiningRefusals(posed, task.board)
                              : viewRefusals(posed, task.board, task.pattern),
           state.views);
}

/// Refuses what a refined model shows of lens, views, board, print and the projector's pixels.
void refuseRefined(const Task& task, const State& state) {
  const ProjectorModel& model = state.model;
  const bool free_camera = state.settings.free_camera;
  if (model.start) refuseIf(driftRefusals(model.start->projector, model.projector), state.views);
  refuseUnfitViews(task, state);
  refuseIf(shapeRefusals(model.shape), state.views);
  refuseIf(printRefusals(task.board, printStretch(model, state.views, free_camera),
                         task.options.measured_ruler_m),
           state.views);
  refuseIf(pixelShapeRefusals(pixelShape(model, state.views, free_camera), model.projector),
           state.views);
}

// --------------------------------------------------------------------------------------- estimates

void refineRounds(State& state, const RefineSettings& settings, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    measureScales(state.model, state.views);
    refine(state.model, state.views, settings);
  }
}

State refined(State state, int rounds) {
  refineRounds(state, state.settings, rounds);
  return state;
}

void startLinearly(const Task& task, State& state) {
  const auto start = linearStart(state.views, task.pattern);
  if (!start) {
    refuseIf({"no projector explains where the projected tags fall: is this the pattern that was "
              "shown, and are pictures and board of one session?"},
             state.views);
  }
  Eigen::Matrix3d K = start->K;
  K(0, 1) = 0;
  state.model.projector = makeLens(task.pattern.width, task.pattern.height, K, {});
  state.model.T_camera_projector = start->T_camera_projector;
}

/// Starts from an earlier calibration or linearly; the boards stay where their printed tags say.
State withFirstLens(const Task& task, State state) {
  if (task.options.start) {
    state.model.projector = task.options.start->projector;
    state.model.T_camera_projector = task.options.start->T_camera_projector;
    const auto& D = state.model.projector.D;
    state.settings.free_rational = D[5] != 0 || D[6] != 0 || D[7] != 0;
  } else {
    startLinearly(task, state);
  }
  RefineSettings coarse;
  coarse.free_boards = false;
  coarse.robust_deviations = 2;
  refineRounds(state, coarse, 4);
  return state;
}

void leaveOut(ViewEvidence& view, double error_px) {
  view.is_used = false;
  view.reason = fmt::format(
      "its projected tags are {:.1f} px off what the other views say: did the board or the "
      "camera move between its pictures, or is the board bent?",
      std::min(error_px, 9999.0));
}

/// Returns the limit above which an error of a view is not chance.
double spoiledLimit(std::vector<double> errors) {
  return std::max(kSpoiledRatio * median(errors, kNever), kSpoiledLeast_px);
}

State withoutSpoiledViews(State state) {
  std::vector<double> middles;
  for (const ViewEvidence& view : state.views) {
    if (view.is_used) middles.push_back(middleError(state.model, view));
  }
  const double limit = spoiledLimit(middles);
  for (std::size_t i = 0; i < state.views.size(); ++i) {
    if (!state.views[i].is_used) continue;
    const double error = middleError(state.model, state.views[i]);
    if (!(error > limit)) continue;
    leaveOut(state.views[i], error);
    state.is_spoiled[i] = true;
  }
  return state;
}

/// Judges views anew that were left out because they contradicted others when seen through the
/// camera as given.
State withSpoiledViewsJudgedAnew(State state) {
  bool any = false;
  for (std::size_t i = 0; i < state.views.size(); ++i) {
    if (!state.is_spoiled[i]) continue;
    state.is_spoiled[i] = false;
    state.views[i].is_used = any = true;
    state.views[i].reason.clear();
    refineBoardPose(state.model, state.views[i]);
  }
  return any ? refined(withoutSpoiledViews(std::move(state)), 2) : state;
}

/// Takes rational distortion if the errors are much smaller with it: three more parameters always
/// fit a little better, and extrapolate worse.
State withRationalIfNeeded(State plain) {
  constexpr double kMuchSmaller = 0.85;
  State rational = plain;
  rational.settings.free_rational = true;
  refine(rational.model, rational.views, rational.settings);
  measureScales(plain.model, plain.views);
  measureScales(rational.model, rational.views);
  const double limit = kMuchSmaller * plain.model.projected_scale;
  return rational.model.projected_scale < limit ? refined(std::move(rational), 1) : plain;
}

State fullyRefined(State state) {
  const bool has_start = state.model.start.has_value();
  state = refined(std::move(state), 2);
  return has_start ? state : withRationalIfNeeded(std::move(state));
}

State withFreeCamera(State state) {
  state.settings.free_camera = true;
  return fullyRefined(std::move(state));
}

/// Measures how far the views contradict camera_info, and decides what becomes of it.
CameraChange cameraChangeOf(State with_free_camera, CameraUse use) {
  const ProjectorModel& model = with_free_camera.model;
  CameraChange change =
      cameraChange(model.camera_info, model.camera, cameraCovariance(with_free_camera.influence()));
  const bool is_refined = use == CameraUse::Refine ||
                          (use == CameraUse::RefineIfContradicted && change.isContradicted());
  change.fate = is_refined               ? CameraFate::Refined
                : use == CameraUse::Hold ? CameraFate::Held
                                         : CameraFate::Agrees;
  return change;
}

/// Keeps camera_info, or its distortion, unless the views contradict it: it may be exact, and more
/// unknowns make the result less certain.
State withCameraSettled(State state, const State& with_free_camera, CameraChange& change) {
  const bool is_refined = change.fate == CameraFate::Refined;
  if (is_refined && change.isDistortionContradicted()) {
    return withSpoiledViewsJudgedAnew(with_free_camera);
  }
  state.model.camera = state.model.camera_info;
  for (ViewEvidence& view : state.views) setRays(view, state.model.camera);
  state.settings.free_camera = is_refined;
  state.settings.free_camera_distortion = false;
  state = fullyRefined(std::move(state));
  if (!is_refined) return state;
  state = withSpoiledViewsJudgedAnew(std::move(state));
  change.describe(state.model.camera_info, state.model.camera);
  return state;
}

// ----------------------------------------------------------------------------------- the evidence

using AllHeldOut = std::vector<std::optional<HeldOut>>;

AllHeldOut heldOut(const Task& task, State& state) {
  return leaveOneOut(state.model, state.views, state.influence(), task.options.threads);
}

/// Leaves out the views that the others do not predict, too.
State withoutUnpredictedViews(const Task& task, State state, AllHeldOut& held_out) {
  std::vector<double> errors;
  for (const auto& one : held_out) {
    if (one) errors.push_back(one->rms_px);
  }
  const double limit = spoiledLimit(errors);
  bool any = false;
  for (std::size_t i = 0; i < state.views.size(); ++i) {
    if (!held_out[i] || !(held_out[i]->rms_px > limit)) continue;
    leaveOut(state.views[i], held_out[i]->rms_px);
    any = true;
  }
  if (!any) return state;
  refuseUnfitViews(task, state);
  state = refined(std::move(state), 2);
  held_out = heldOut(task, state);
  return state;
}

/// Sets the estimate and its light, with the covariance that the uncertainties of camera and board
/// are part of: also that of a camera_info which the views just do not contradict; unless it was
/// held. Returns the estimate as if the camera were known.
ProjectorEstimate setEstimate(const State& state, Calibration& calibration) {
  State held = state;
  measureScales(held.model, held.views);
  widenScales(held.model, held.views);
  State open = held;
  held.settings.free_camera = false;
  open.settings.free_camera = calibration.camera_change.fate != CameraFate::Held;
  open.settings.free_camera_distortion = true;
  held.settings.free_shape = open.settings.free_shape = true;
  const Influence influence = open.influence();
  const ProjectorEstimate plain = estimateOf(open.model, influence);
  const Beam beam(plain, state.model.camera);
  const double dispersion = influence.dispersion(beam.importance());
  calibration.estimate = estimateOf(open.model, influence, dispersion);
  const auto used = std::count_if(state.views.begin(), state.views.end(),
                                  [](const ViewEvidence& view) { return view.is_used; });
  calibration.light = beam.errors(calibration.estimate, plain, static_cast<int>(used));
  calibration.print_mm_per_permille = state.model.T_camera_projector.matrix().translation().norm();
  return estimateOf(held.model, held.influence(), dispersion);
}

Coverage coverageOfUsed(const Task& task, const State& state) {
  std::vector<View> used;
  for (std::size_t i = 0; i < state.views.size(); ++i) {
    if (state.views[i].is_used) used.push_back(task.views[i]);
  }
  return coverageOf(used, task.pattern);
}

void setEvidence(const Task& task, const State& state, const AllHeldOut& held_out,
                 Calibration& calibration) {
  calibration.camera = state.model.camera;
  calibration.camera_info = state.model.camera_info;
  calibration.board_shape = state.model.shape;
  calibration.predicted_mm = predictedError(calibration.estimate, posedViews(state.views)).mm;
  calibration.coverage = coverageOfUsed(task, state);
  for (std::size_t i = 0; i < state.views.size(); ++i) {
    calibration.views.push_back(viewResult(state.model, state.views[i], held_out[i]));
  }
  setErrors(calibration, held_out);
}

/// Refuses a result that cannot be trusted, and warns of what is left. More views do not help where
/// the camera is not known well: its part of the uncertainty is no reason.
void judge(const Task& task, const State& state, const ProjectorEstimate& through_known_camera,
           Calibration& calibration) {
  const Lens& projector = calibration.estimate.projector;
  const std::vector<PosedView> posed = posedViews(state.views);
  refuseIf(foldRefusals(projector), state.views);
  refuseIf(misfitRefusals(calibration.held_out_rms_px, projector), state.views);
  refuseIf(uncertaintyRefusals(through_known_camera, posed), state.views);
  std::vector<std::string>& warnings = calibration.warnings;
  const auto warnOf = [&warnings](const std::vector<std::string>& more) {
    warnings.insert(warnings.end(), more.begin(), more.end());
  };
  if (!task.options.start) {
    const Reach reach = reachOf(calibration.estimate, calibration.camera, task.pattern, posed);
    refuseIf(reachRefusals(reach), state.views);
    warnOf(reachWarnings(reach));
  }
  for (const ViewResult& view : calibration.views) {
    if (!view.is_used) warnings.push_back(view.name + " left out: " + view.reason);
  }
  const std::string unsure_size = unsureSizeText(task.board);
  if (!unsure_size.empty()) warnings.push_back(unsure_size);
  warnOf(shapeWarnings(state.model.shape));
  warnOf(cameraWarnings(state.model.camera_info, calibration.camera_change));
  if (state.settings.free_rational) {
    warnings.push_back("the lens needed rational distortion (8 coefficients)");
  }
}

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

/// A lens good enough to read the tags once more: print and pixels are not looked at.
Lens roughProjector(const Task& task, const Lens& camera) {
  State state = stateOf(task, camera);
  refuseUnfitViews(task, state);
  state = withoutSpoiledViews(withFirstLens(task, std::move(state)));
  return refined(std::move(state), 1).model.projector;
}

}  // namespace

Calibration solveViews(const std::vector<View>& views, const Board& board, const Pattern& pattern,
                       const Lens& camera, const SolveOptions& options,
                       const CalibrationProgress& progress) {
  const Task task{views, board, pattern, options, progress};
  task.say("starting", 0);
  State state = stateOf(task, camera);
  // A print of another size, and views that say too little, are refused before anything is solved.
  refuseIf(printRefusals(board, std::nullopt, options.measured_ruler_m), state.views);
  refuseUnfitViews(task, state);
  // A first lens shows which views contradict the others; they are left out.
  state = withoutSpoiledViews(withFirstLens(task, std::move(state)));
  // Lens, board poses, the board's shape and the camera are refined together, and the better lens
  // shows once more which views contradict the others.
  task.say("refining", 0.2);
  state.settings.free_camera = options.camera_use != CameraUse::Hold;
  state.settings.free_shape = true;
  state = withoutSpoiledViews(refined(std::move(state), 2));
  refuseRefined(task, state);
  // With the camera free it shows whether camera_info is right; it is used unless it is not.
  const State with_free_camera = withFreeCamera(state);
  Calibration calibration;
  CameraChange& change = calibration.camera_change;
  change = cameraChangeOf(with_free_camera, options.camera_use);
  refuseIf(cameraRefusals(camera, change), with_free_camera.views);
  state = withCameraSettled(std::move(state), with_free_camera, change);
  // Each view is predicted by the others: the error that a new view would have.
  task.say("leaving out one view after the other", 0.5);
  AllHeldOut held_out = heldOut(task, state);
  state = withoutUnpredictedViews(task, std::move(state), held_out);
  // The estimate with its covariance, and the evidence that a report shows.
  task.say("measuring uncertainty", 0.8);
  const ProjectorEstimate through_known_camera = setEstimate(state, calibration);
  setEvidence(task, state, held_out, calibration);
  // A result that cannot be trusted is refused.
  judge(task, state, through_known_camera, calibration);
  task.say("done", 1);
  return calibration;
}

Calibration solvePhotographs(const std::vector<Photographs>& photographs, const Board& board,
                             const Pattern& pattern, const Lens& camera,
                             const SolveOptions& options, const CalibrationProgress& progress) {
  const ViewReader reader(board, pattern, camera);
  const std::vector<View> first =
      readAll(photographs.size(), "reading tags", 0, 0.5, options, progress,
              [&](std::size_t i) { return reader.glance(photographs[i]); });
  const Lens projector = roughProjector({first, board, pattern, options, progress}, camera);
  const std::vector<View> second = readAll(
      photographs.size(), "reading tags through the projector's lens", 0.55, 0.8, options, progress,
      [&](std::size_t i) { return reader.observeAgain(first[i], photographs[i], projector); });
  const CalibrationProgress last = [&](const std::string& doing, double share) {
    if (progress) progress(doing, 0.8 + 0.2 * share);
  };
  return solveViews(second, board, pattern, camera, options, last);
}

}  // namespace afterglow::calib

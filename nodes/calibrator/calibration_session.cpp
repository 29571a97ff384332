#include "nodes/calibrator/calibration_session.hpp"

#include <fmt/format.h>

#include <chrono>
#include <exception>
#include <stdexcept>
#include <utility>

namespace afterglow::nodes {

using calib::GuidePhase;
using Lock = std::lock_guard<std::mutex>;

namespace {

std::vector<std::string> litRows(const calib::Coverage& coverage) {
  using calib::Coverage;
  constexpr int kSide = calib::PictureNinth::kSide;
  const std::vector<calib::PictureNinth> missing = calib::missingPlaces(coverage);
  std::vector<std::string> rows(Coverage::kRows, std::string(Coverage::kColumns, '.'));
  const auto isNext = [&](int row, int column) {
    const auto within = [](int place, int ninth, int places) {
      return place >= ninth * places / kSide && place < (ninth + 1) * places / kSide;
    };
    return !missing.empty() && within(row, missing[0].row, Coverage::kRows) &&
           within(column, missing[0].column, Coverage::kColumns);
  };
  for (std::size_t i = 0; i < coverage.corners.size(); ++i) {
    const std::size_t row = i / Coverage::kColumns, column = i % Coverage::kColumns;
    if (coverage.corners[i] > 0) {
      rows[row][column] = '#';
    } else if (isNext(static_cast<int>(row), static_cast<int>(column))) {
      rows[row][column] = '+';
    }
  }
  return rows;
}

}  // namespace

CalibrationSession::CalibrationSession(const calib::Board& board, const calib::Pattern& pattern,
                                       const calib::GuideOptions& options,
                                       const CalibrationFolder& folder, bool is_started)
    : board_(board),
      pattern_(pattern),
      options_(options),
      folder_(folder),
      is_started_(is_started) {}

// ------------------------------------------------------------------------------------- services

CalibrationSession::Answer CalibrationSession::start(const std::string& camera_problem) {
  const Lock lock(mutex_);
  try {
    folder_.begin();
  } catch (const std::exception& error) {
    return {false, error.what()};
  }
  guide_.reset();
  photographs_.clear();
  calibration_.reset();
  check_ = {};
  delay_ms_.reset();
  ++starts_;
  is_started_ = true;
  return {true, camera_problem.empty() ? "started"
                                       : "starts as soon as it can; now: " + camera_problem};
}

CalibrationSession::Answer CalibrationSession::stop() {
  const Lock lock(mutex_);
  is_started_ = false;
  const bool was_running = guide_ && guide_->phase() != GuidePhase::Idle;
  if (guide_) guide_->stop();
  return {was_running, was_running ? "stopped" : "nothing was running"};
}

CalibrationSession::Answer CalibrationSession::takeView() {
  const Lock lock(mutex_);
  if (guide_ && guide_->forceView()) return {true, "taking the next view that shows the board"};
  return {false, "no views are being taken: call ~start first"};
}

CalibrationSession::Answer CalibrationSession::solveNow() {
  const Lock lock(mutex_);
  if (!guide_ || !guide_->solveNow()) {
    return {false, "there are no views yet, or it is solving already"};
  }
  return {true, "solving from " + std::to_string(guide_->views().size()) + " views"};
}

CalibrationSession::Answer CalibrationSession::discardLast() {
  const Lock lock(mutex_);
  const auto name = guide_ ? guide_->discardLast() : std::nullopt;
  if (!name) return {false, "there is no view to discard"};
  if (!photographs_.empty() && photographs_.back().name == *name) photographs_.pop_back();
  try {
    folder_.discard(*name);
  } catch (const std::exception& error) {
    return {true, *name + " is discarded, but its pictures stay: " + error.what()};
  }
  return {true, *name + " is discarded"};
}

// ------------------------------------------------------------------------------------- watching

bool CalibrationSession::awaitsCamera() const {
  const Lock lock(mutex_);
  return is_started_;
}

void CalibrationSession::begin(const calib::Lens& camera) {
  const Lock lock(mutex_);
  if (!std::exchange(is_started_, false)) return;
  guide_.emplace(board_, pattern_, camera, options_);
  guide_->start();
}

bool CalibrationSession::takesViews() const {
  const Lock lock(mutex_);
  return guide_ && (guide_->phase() == GuidePhase::Collecting ||
                    guide_->phase() == GuidePhase::Verifying);
}

bool CalibrationSession::isVerifying() const {
  const Lock lock(mutex_);
  return guide_ && guide_->phase() == GuidePhase::Verifying;
}

bool CalibrationSession::isTiming() const {
  const Lock lock(mutex_);
  return guide_ && guide_->phase() == GuidePhase::Timing;
}

std::optional<CalibrationSession::Seen> CalibrationSession::see(const calib::WatchedImage& image) {
  const Lock lock(mutex_);
  if (!guide_) return std::nullopt;
  Seen seen;
  seen.answer = guide_->see(image);
  seen.shown = guide_->shown();
  seen.view_name = guide_->phase() == GuidePhase::Verifying ? "view_00" : guide_->nextName();
  return seen;
}

void CalibrationSession::addView(const calib::View& view,
                                 const Rigid<Camera, Surface>& T_camera_board,
                                 const calib::Photographs& photographs) {
  const Lock lock(mutex_);
  if (!guide_ || !guide_->addView(view, T_camera_board)) return;
  photographs_.push_back(photographs);
  folder_.keep(photographs);  // before anybody can discard it
}

bool CalibrationSession::addCheck(const calib::ErrorSummary& errors, const std::string& fault) {
  const Lock lock(mutex_);
  if (!guide_) return false;
  if (!fault.empty()) guide_->tell(fault);
  guide_->checked(errors);
  check_ = errors;
  return true;
}

void CalibrationSession::timed(const std::optional<double>& ms, const std::string& words) {
  const Lock lock(mutex_);
  if (!guide_ || guide_->phase() != GuidePhase::Timing) return;
  delay_ms_ = ms;
  guide_->timed(words);
}

// -------------------------------------------------------------------------------------- solving

std::optional<CalibrationSession::Task> CalibrationSession::task() const {
  const Lock lock(mutex_);
  if (!guide_ || guide_->phase() != GuidePhase::Solving) return std::nullopt;
  return Task{photographs_, starts_};
}

bool CalibrationSession::isAwaited(unsigned start) const {
  return guide_ && starts_ == start && guide_->phase() == GuidePhase::Solving;
}

bool CalibrationSession::awaitsSolution(unsigned start) const {
  const Lock lock(mutex_);
  return isAwaited(start);
}

void CalibrationSession::refused(unsigned start, const std::vector<std::string>& reasons) {
  const Lock lock(mutex_);
  if (isAwaited(start)) guide_->refused(reasons);
}

void CalibrationSession::solved(unsigned start, const calib::Calibration& calibration,
                                const std::string& filed) {
  const Lock lock(mutex_);
  if (!isAwaited(start)) return;
  calibration_ = calibration;
  guide_->solved(calibration);
  guide_->tell(filed);
}

std::optional<calib::Calibration> CalibrationSession::calibration() const {
  const Lock lock(mutex_);
  return calibration_;
}

// --------------------------------------------------------------------------------------- saying

bool CalibrationSession::tell(const std::string& text) {
  const Lock lock(mutex_);
  if (guide_) guide_->tell(text);
  return guide_.has_value();
}

CalibrationSession::News CalibrationSession::takeNews() {
  const Lock lock(mutex_);
  if (!guide_) return {};
  return {guide_->takeUtterances(), guide_->progress(), guide_->shown()};
}

CalibratorState CalibrationSession::state() const {
  const Lock lock(mutex_);
  CalibratorState state;
  state.phase = guide_ ? calib::phaseName(guide_->phase()) : is_started_ ? "waiting" : "idle";
  state.views_wanted = options_.views;
  if (guide_) {
    state.views = static_cast<int>(guide_->views().size());
    state.views_wanted = guide_->viewsWanted();
    state.discarded = guide_->discarded();
    state.coverage = guide_->coverage().share();
    state.lit = litRows(guide_->coverage());
  }
  if (calibration_) state.held_out_mm = calibration_->held_out_rms_mm;
  if (check_.corners > 0) state.check_mm = check_.rms_mm;
  state.delay_ms = delay_ms_;
  return state;
}

BackgroundSolver::BackgroundSolver(const calib::Board& board, const calib::Pattern& pattern,
                                   const calib::SolveOptions& options,
                                   const CalibrationFolder& folder)
    : board_(board), pattern_(pattern), options_(options), folder_(folder) {}

void BackgroundSolver::start(CalibrationSession::Task task, const calib::Lens& camera) {
  running_ = std::async(std::launch::async, [this, camera, task = std::move(task)]() mutable {
    return solve(std::move(task), camera);
  });
}

BackgroundSolver::Solution BackgroundSolver::solve(CalibrationSession::Task task,
                                                   const calib::Lens& camera) {
  const auto report = [this](const std::string& doing, double share) {
    if (is_stopping_) throw std::runtime_error("stopped");
    const std::lock_guard<std::mutex> lock(mutex_);
    progress_ = fmt::format("{}, {:.0f} %", doing, 100 * share);
  };
  Solution solution;
  try {
    solution.calibration =
        calib::solvePhotographs(task.photographs, board_, pattern_, camera, options_, report);
  } catch (const calib::CalibrationRefused& refused) {
    solution.reasons = refused.reasons();
    try {
      folder_.saveRefusal(refused, task.photographs);
    } catch (const std::exception& error) {
      solution.reasons.push_back(error.what());
    }
  } catch (const std::exception& error) {
    solution.reasons = {error.what()};
  }
  solution.task = std::move(task);
  return solution;
}

std::optional<BackgroundSolver::Solution> BackgroundSolver::take() {
  if (!isRunning() || running_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return std::nullopt;
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  progress_.clear();
  return running_.get();
}

std::string BackgroundSolver::progress() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return progress_;
}

void BackgroundSolver::stop() {
  is_stopping_ = true;
  if (isRunning()) running_.wait();
}

}  // namespace afterglow::nodes

#include "nodes/calibrator/background_solver.hpp"

#include <fmt/format.h>

#include <chrono>
#include <exception>
#include <stdexcept>
#include <utility>

namespace afterglow::nodes {

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

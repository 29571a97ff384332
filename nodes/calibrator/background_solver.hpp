/// \file
/// Solves a calibration in a thread of its own, so that the camera is watched meanwhile.
#pragma once

#include <atomic>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "calib/solver/solve.hpp"
#include "nodes/calibrator/calibration_session.hpp"

namespace afterglow::nodes {

/// Solves one task at a time; used by one thread, progress() by any. To be used by one thread;
/// progress() by any.
class BackgroundSolver {
 public:
  struct Solution {
    std::optional<calib::Calibration> calibration;
    std::vector<std::string> reasons;  ///< reasons why there is no calibration
    CalibrationSession::Task task;
  };

  /// `folder` gets the report of a refusal and must outlive this.
  BackgroundSolver(const calib::Board& board, const calib::Pattern& pattern,
                   const calib::SolveOptions& options, const CalibrationFolder& folder);
  ~BackgroundSolver() { stop(); }

  bool isRunning() const { return running_.valid(); }
  /// Not while it is running.
  void start(CalibrationSession::Task task, const calib::Lens& camera);
  /// The solution, once; empty before it is ready.
  std::optional<Solution> take();
  /// "solving, 40 %"; empty when nothing runs.
  std::string progress() const;
  /// Gives up what runs, and waits for its end.
  void stop();

 private:
  Solution solve(CalibrationSession::Task task, const calib::Lens& camera);

  const calib::Board board_;
  const calib::Pattern pattern_;
  const calib::SolveOptions options_;
  const CalibrationFolder& folder_;
  mutable std::mutex mutex_;  ///< progress_
  std::string progress_;
  std::atomic<bool> is_stopping_{false};
  std::future<Solution> running_;
};

}  // namespace afterglow::nodes

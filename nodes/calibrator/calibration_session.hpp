/// \file
/// A live calibration, from its start to its check: the guide, the photographs and the results,
/// which the node's services and its watching thread share. No ROS.
///
/// Solves a calibration in a thread of its own, so that the camera is watched meanwhile.
#pragma once

#include <atomic>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "calib/detection/observe.hpp"
#include "calib/guide/guide.hpp"
#include "calib/landing.hpp"
#include "calib/solver/calibration.hpp"
#include "calib/solver/solve.hpp"
#include "nodes/tools/calibration_folder.hpp"

namespace afterglow::nodes {

struct CalibratorState {
  std::string phase = "idle";  ///< waiting (for camera or camera_info), or calib::phaseName
  std::string problem;         ///< problem of the camera; empty: there is none
  std::string doing;           ///< while solving
  int views = 0, views_wanted = 0, discarded = 0;
  double coverage = 0;  ///< 0 to 1
  /// Rows of the projector's picture, from its top: '#' where a board was lit, '.' where none was,
  /// '+' where none was and one should be held next.
  std::vector<std::string> lit;
  std::optional<double> held_out_mm, check_mm, delay_ms;
};

/// Safe from any thread. Between start() and begin() it waits for the camera: the guide needs the
/// camera's lens.
class CalibrationSession {
 public:
  /// The answer of a service.
  struct Answer {
    bool success = false;
    std::string message;
  };
  /// The photographs to be solved, and which of the starts they belong to.
  struct Task {
    std::vector<calib::Photographs> photographs;
    unsigned start = 0;
  };
  /// The guide's word on an image, and what has to be shown from now on.
  struct Seen {
    calib::TakerAnswer answer;
    calib::Shown shown = calib::Shown::Black;
    std::string view_name;  ///< name of the view that this image may be a photograph of
  };
  /// News to be said and shown.
  struct News {
    std::vector<calib::Utterance> utterances;
    std::string progress;
    calib::Shown shown = calib::Shown::Black;
  };

  /// `folder` gets every view and must outlive this. `is_started`: without a call of start().
  CalibrationSession(const calib::Board& board, const calib::Pattern& pattern,
                     const calib::GuideOptions& options, const CalibrationFolder& folder,
                     bool is_started);

  // The services. `camera_problem`: why there are no images yet, or empty.
  Answer start(const std::string& camera_problem);
  Answer stop();
  Answer takeView();
  Answer solveNow();
  Answer discardLast();

  /// Returns true if it is started and waits for the camera's lens.
  bool awaitsCamera() const;
  /// Begins with this camera, unless it has been stopped meanwhile.
  void begin(const calib::Lens& camera);
  /// Returns true while views are taken: for the calibration or for its check.
  bool takesViews() const;
  bool isVerifying() const;
  bool isTiming() const;  ///< the projector's delay is being measured
  /// Empty if it was started anew meanwhile; so are the functions below then without effect.
  std::optional<Seen> see(const calib::WatchedImage& image);
  /// Adds and files the view that the photographs show. Throws as CalibrationFolder does.
  void addView(const calib::View& view, const Rigid<Camera, Surface>& T_camera_board,
               const calib::Photographs& photographs);
  /// The check's errors, and why it could not be measured, or empty. False without effect.
  bool addCheck(const calib::ErrorSummary& errors, const std::string& fault);

  /// Ends the measurement of the delay: `ms`, or nothing, and the words about it.
  void timed(const std::optional<double>& ms, const std::string& words);

  /// Empty unless the guide is waiting for a solution.
  std::optional<Task> task() const;
  /// Returns true while the solution of this start's task is still waited for.
  bool awaitsSolution(unsigned start) const;
  void refused(unsigned start, const std::vector<std::string>& reasons);
  /// `filed`: where it has been written, or why it could not be, for people.
  void solved(unsigned start, const calib::Calibration& calibration, const std::string& filed);
  std::optional<calib::Calibration> calibration() const;

  /// False without a guide to tell it.
  bool tell(const std::string& text);
  News takeNews();
  /// Returns the state without the camera's problem and the solver's progress, which others know.
  CalibratorState state() const;

 private:
  bool isAwaited(unsigned start) const;  ///< needs the mutex held

  const calib::Board board_;
  const calib::Pattern pattern_;
  const calib::GuideOptions options_;
  const CalibrationFolder& folder_;

  mutable std::mutex mutex_;  ///< all below
  bool is_started_;           ///< and waits for the camera
  unsigned starts_ = 0;       ///< number of starts; results of an earlier start are dropped
  std::optional<calib::Guide> guide_;
  std::vector<calib::Photographs> photographs_;
  std::optional<calib::Calibration> calibration_;
  calib::ErrorSummary check_;  ///< errors of the check; without corners before it
  std::optional<double> delay_ms_;
};

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

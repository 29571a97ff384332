#include <fmt/format.h>
#include <sensor_msgs/CameraInfo.h>

#include <exception>
#include <stdexcept>
#include <utility>

#include "nodes/calibrator/calibrator_messages.hpp"
#include "nodes/calibrator/calibrator_node.hpp"
#include "nodes/projector/projector_messages.hpp"

namespace afterglow::nodes {

using calib::GuidePhase;

void CalibratorNode::solveWhenDue() {
  if (solving_.valid()) return;  // an earlier one, which was given up, still runs
  std::vector<calib::Photographs> photographs;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!guide_ || guide_->phase() != GuidePhase::Solving) return;
    photographs = photographs_;
    solving_session_ = session_;
  }
  auto job = [this, camera = *camera_, photographs = std::move(photographs)]() mutable {
    return solve(std::move(photographs), camera);
  };
  solving_ = std::async(std::launch::async, std::move(job));
}

CalibratorNode::Solution CalibratorNode::solve(std::vector<calib::Photographs> photographs,
                                               const calib::Lens& camera) {
  const auto progress = [this](const std::string& doing, double share) {
    if (is_stopping_) throw std::runtime_error("stopped");
    const std::lock_guard<std::mutex> lock(mutex_);
    progress_ = fmt::format("{}, {:.0f} %", doing, 100 * share);
  };
  calib::SolveOptions solve_options;
  solve_options.camera_use = options_.camera_use;
  solve_options.measured_ruler_m = options_.measured_ruler_m;
  Solution solution;
  try {
    solution.calibration =
        calib::solvePhotographs(photographs, board_, pattern_, camera, solve_options, progress);
  } catch (const calib::CalibrationRefused& refused) {
    solution.reasons = refused.reasons();
    try {
      folder_.saveRefusal(refused, photographs);
    } catch (const std::exception& error) {
      solution.reasons.push_back(error.what());
    }
  } catch (const std::exception& error) {
    solution.reasons = {error.what()};
  }
  solution.photographs = std::move(photographs);
  return solution;
}

void CalibratorNode::takeSolution() {
  if (!solving_.valid() ||
      solving_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    return;
  }
  const Solution solution = solving_.get();
  const auto isWanted = [this] {  // with the mutex held
    return guide_ && session_ == solving_session_ && guide_->phase() == GuidePhase::Solving;
  };
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    progress_.clear();
    if (!isWanted()) return;
    if (!solution.calibration) return guide_->refused(solution.reasons);
  }
  std::string problem;
  try {
    folder_.save(*solution.calibration, solution.photographs, facts());
  } catch (const std::exception& error) {
    problem = error.what();
  }
  publishCalibration(*solution.calibration);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!isWanted()) return;
  calibration_ = solution.calibration;
  guide_->solved(*solution.calibration);
  guide_->tell(problem.empty() ? "saved in " + options_.out : "not saved: " + problem);
}

void CalibratorNode::publishCalibration(const calib::Calibration& calibration) {
  const calib::CalibrationNames frames = names();
  sensor_msgs::CameraInfo info = toCameraInfo(calibration.estimate.projector);
  info.header.stamp = ros::Time::now();
  info.header.frame_id = frames.projector_frame;
  camera_info_.publish(info);
  if (!transforms_) return;
  transforms_->sendTransform(toTransform(calibration.estimate.T_camera_projector,
                                         frames.camera_frame, frames.projector_frame));
}

calib::CalibrationNames CalibratorNode::names() const {
  calib::CalibrationNames all = options_.names;
  if (!camera_frame_.empty()) all.camera_frame = camera_frame_;
  return all;
}

calib::ReportFacts CalibratorNode::facts() const { return {names(), board_, pattern_}; }

// --------------------------------------------------------------------------------------- saying

void CalibratorNode::showAndSay() {
  std::vector<calib::Utterance> utterances;
  std::string progress, status, problem = inbox_.problem();
  if (problem.empty()) problem = picture_problem_;
  calib::Shown shown = calib::Shown::Black;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    problem_ = problem;
    if (guide_) {
      utterances = guide_->takeUtterances();
      progress = guide_->progress();
      shown = guide_->shown();
    }
    status = toJson(state());
  }
  screen_.show(shown);
  for (const calib::Utterance& utterance : utterances) voice_.say(utterance, progress);
  voice_.complain(problem);
  voice_.showStatus(status);
}

CalibratorState CalibratorNode::state() const {
  CalibratorState state;
  state.phase = guide_ ? calib::phaseName(guide_->phase()) : is_started_ ? "waiting" : "idle";
  state.problem = problem_;
  state.doing = progress_;
  state.views_wanted = options_.guide.views;
  if (guide_) {
    state.views = static_cast<int>(guide_->views().size());
    state.views_wanted = guide_->viewsWanted();
    state.discarded = guide_->discarded();
    state.coverage = guide_->coverage();
  }
  if (calibration_) state.held_out_mm = calibration_->held_out_rms_mm;
  if (check_.corners > 0) state.check_mm = check_.rms_mm;
  return state;
}

void CalibratorNode::publishDiagnostics() {
  CalibratorState now;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    now = state();
  }
  diagnostic_msgs::DiagnosticArray array = toDiagnostics(now, ros::this_node::getName().substr(1));
  array.header.stamp = ros::Time::now();
  diagnostics_.publish(array);
}

}  // namespace afterglow::nodes

#include "nodes/calibrator/calibrator_node.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <fmt/format.h>
#include <sensor_msgs/CameraInfo.h>

#include <exception>
#include <stdexcept>
#include <utility>

#include "calib/camera_info_file.hpp"
#include "calib/targets/target_files.hpp"
#include "calib/verify/view_check.hpp"

namespace afterglow::nodes {
namespace {

using calib::GuidePhase;
using Keep = calib::TakerAnswer::Keep;

constexpr std::chrono::milliseconds kFramePatience{50};

std::optional<calib::Lens> lensOfFile(const std::string& path) {
  if (path.empty()) return std::nullopt;
  const calib::CameraInfoFile file = calib::loadCameraInfo(path);
  if (!file.warning.empty()) ROS_WARN("%s: %s", path.c_str(), file.warning.c_str());
  return file.lens;
}

calib::Pattern patternOf(const CalibratorOptions& options) {
  if (!options.pattern.empty()) return calib::loadPattern(options.pattern);
  return calib::makePattern(options.width, options.height);
}

}  // namespace

CalibratorNode::CalibratorNode(const CalibratorOptions& options)
    : options_(options),
      board_(calib::loadBoard(options.board)),
      pattern_(patternOf(options)),
      folder_(options.out),
      is_started_(options.is_started),
      screen_(pattern_, options.names.projector_frame),
      voice_(options.is_spoken),
      inbox_(options.image_topic, options.camera_info_topic, lensOfFile(options.camera_info)) {
  folder_.begin();
  if (options_.pattern.empty()) calib::writePattern(options_.out, pattern_);
  camera_info_ = own_.advertise<sensor_msgs::CameraInfo>("camera_info", 1, true);
  diagnostics_ = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 2);
  if (options_.publishes_transform) transforms_.emplace();
  advertiseServices();
  diagnostics_timer_ = nh_.createWallTimer(
      ros::WallDuration(1), [this](const ros::WallTimerEvent&) { publishDiagnostics(); });
  watching_ = std::thread([this] { watchLoop(); });
}

CalibratorNode::~CalibratorNode() { stop(); }

void CalibratorNode::stop() {
  const std::lock_guard<std::mutex> lock(stop_mutex_);
  is_stopping_ = true;
  if (watching_.joinable()) watching_.join();
  screen_.show(calib::Shown::Black);
}

void CalibratorNode::tell(const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (guide_) return guide_->tell(text);
  ROS_WARN("%s", text.c_str());
}

// ------------------------------------------------------------------------------------- watching

void CalibratorNode::watchLoop() {
  while (!is_stopping_) {
    try {
      std::optional<CameraFrame> frame = inbox_.take(kFramePatience);
      takeSolution();
      if (frame) onFrame(std::move(*frame));
      solveWhenDue();
    } catch (const std::exception& error) {  // a full disk, a hostile message: the next may do
      picture_problem_ = error.what();
    }
    showAndSay();
  }
  if (solving_.valid()) solving_.wait();  // it has been told to end
}

void CalibratorNode::onFrame(CameraFrame frame) {
  if (!hasGuide(frame)) return;
  GuidePhase phase;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!guide_) return;
    phase = guide_->phase();
  }
  if (phase != GuidePhase::Collecting && phase != GuidePhase::Verifying) return;
  const calib::WatchedFrame watched = watch_->look(frame.picture, frame.stamp_ns);
  calib::TakerAnswer answer;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!guide_) return;
    answer = guide_->see(watched);
    pending_.name = guide_->phase() == GuidePhase::Verifying ? "view_00" : guide_->nextName();
    screen_.show(guide_->shown());
  }
  keep(answer.keep, std::move(frame.picture));
  if (answer.is_complete && answer.T_camera_board) finishView(*answer.T_camera_board);
}

bool CalibratorNode::hasGuide(const CameraFrame& frame) {
  const std::optional<calib::Lens> camera = inbox_.lens();
  if (!camera) return false;
  picture_problem_.clear();
  if (camera->width != frame.picture.width || camera->height != frame.picture.height) {
    picture_problem_ =
        fmt::format("the camera's pictures are {}x{} but its camera_info is for {}x{}: calibrate "
                    "the camera at the resolution in use",
                    frame.picture.width, frame.picture.height, camera->width, camera->height);
    return false;
  }
  camera_frame_ = options_.camera_frame.empty() ? frame.frame_id : options_.camera_frame;
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!is_started_) return guide_.has_value();
  is_started_ = false;
  beginGuide(*camera);
  return true;
}

void CalibratorNode::beginGuide(const calib::Lens& camera) {
  camera_ = camera;
  watch_.emplace(board_, pattern_, camera.width);
  reader_.emplace(board_, pattern_, camera);
  guide_.emplace(board_, pattern_, camera, options_.guide);
  guide_->start();
  folder_.keepCamera(camera);
}

void CalibratorNode::keep(Keep kind, calib::Picture picture) {
  if (kind == Keep::Pattern) pending_.pattern = std::move(picture);
  if (kind == Keep::Plain) pending_.plain = std::move(picture);
}

void CalibratorNode::finishView(const Rigid<Camera, Surface>& T_camera_board) {
  const calib::View view = reader_->observe(pending_);
  std::unique_lock<std::mutex> lock(mutex_);
  if (!guide_) return;
  if (guide_->phase() == GuidePhase::Verifying) {
    lock.unlock();
    return finishCheck(view);
  }
  if (!guide_->addView(view, T_camera_board)) return;
  photographs_.push_back(pending_);
  folder_.keep(pending_);  // before anybody can discard it
}

void CalibratorNode::finishCheck(const calib::View& first) {
  std::optional<calib::Calibration> calibration;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    calibration = calibration_;
  }
  if (!calibration) return;
  const calib::View view = reader_->observeAgain(first, pending_, calibration->estimate.projector);
  const calib::ViewCheck check =
      calib::checkView(view, board_, pattern_, calibration->camera, calibration->estimate);
  const calib::ErrorSummary errors = calib::summarize(check.errors);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!guide_) return;
    if (!check.fault.empty()) guide_->tell(check.fault);
    guide_->checked(errors);
    check_ = errors;
  }
  if (errors.corners > 0) folder_.saveCheck(errors, pending_);
}

// ------------------------------------------------------------------------------------- services

void CalibratorNode::advertiseServices() {
  const auto add = [this](const char* name, auto method) {
    services_.push_back(own_.advertiseService(name, method, this));
  };
  add("start", &CalibratorNode::onStart);
  add("stop", &CalibratorNode::onStop);
  add("take", &CalibratorNode::onTake);
  add("solve", &CalibratorNode::onSolve);
  add("discard_last", &CalibratorNode::onDiscardLast);
}

bool CalibratorNode::onStart(Trigger::Request& /*request*/, Trigger::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    folder_.begin();
  } catch (const std::exception& error) {
    response.message = error.what();
    return true;
  }
  guide_.reset();
  photographs_.clear();
  calibration_.reset();
  check_ = {};
  ++session_;
  is_started_ = true;
  response.success = true;
  const std::string problem = inbox_.problem();
  response.message = problem.empty() ? "started" : "starts as soon as it can; now: " + problem;
  return true;
}

bool CalibratorNode::onStop(Trigger::Request& /*request*/, Trigger::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_started_ = false;
  response.success = guide_ && guide_->phase() != GuidePhase::Idle;
  response.message = response.success ? "stopped" : "nothing was running";
  if (guide_) guide_->stop();
  return true;
}

bool CalibratorNode::onTake(Trigger::Request& /*request*/, Trigger::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  response.success = guide_ && guide_->forceView();
  response.message = response.success ? "taking the next view that shows the board"
                                      : "no views are being taken: call ~start first";
  return true;
}

bool CalibratorNode::onSolve(Trigger::Request& /*request*/, Trigger::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  response.success = guide_ && guide_->solveNow();
  response.message = response.success
                         ? "solving from " + std::to_string(guide_->views().size()) + " views"
                         : "there are no views yet, or it is solving already";
  return true;
}

bool CalibratorNode::onDiscardLast(Trigger::Request& /*request*/, Trigger::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto name = guide_ ? guide_->discardLast() : std::nullopt;
  response.success = name.has_value();
  response.message = name ? *name + " is discarded" : "there is no view to discard";
  if (!name) return true;
  if (!photographs_.empty() && photographs_.back().name == *name) photographs_.pop_back();
  try {
    folder_.discard(*name);
  } catch (const std::exception& error) {
    response.message += ", but its pictures stay: " + std::string(error.what());
  }
  return true;
}

}  // namespace afterglow::nodes

#include "nodes/calibrator/calibrator_node.hpp"

#include <fmt/format.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <boost/function.hpp>
#include <chrono>
#include <exception>
#include <utility>

#include "calib/camera_info_file.hpp"
#include "calib/targets/target_files.hpp"
#include "nodes/projector/output_config.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::chrono::milliseconds kImagePatience{50};

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

calib::SolveOptions solveOptions(const CalibratorOptions& options) {
  calib::SolveOptions solve;
  solve.camera_use = options.camera_use;
  solve.measured_ruler_m = options.measured_ruler_m;
  return solve;
}

}  // namespace

CalibratorNode::CalibratorNode(const CalibratorOptions& options)
    : CalibratorNode(options, calib::loadBoard(options.board), patternOf(options)) {}

CalibratorNode::CalibratorNode(const CalibratorOptions& options, const calib::Board& board,
                               const calib::Pattern& pattern)
    : options_(options),
      folder_(options.out),
      session_(board, pattern, options.guide, folder_, options.is_started),
      solver_(board, pattern, solveOptions(options), folder_),
      facts_{options.names, board, pattern},
      screen_(pattern, options.names.projector_frame),
      topics_(options.is_spoken, options.publishes_transform),
      camera_(options.image_topic, options.camera_info_topic, lensOfFile(options.camera_info)) {
  folder_.begin();
  if (options_.pattern.empty()) calib::writePattern(options_.out, pattern);
  advertise("start", [this] { return session_.start(camera_.problem()); });
  advertise("stop", [this] { return session_.stop(); });
  advertise("take", [this] { return session_.takeView(); });
  advertise("solve", [this] { return session_.solveNow(); });
  advertise("discard_last", [this] { return session_.discardLast(); });
  watching_.begin();
}

CalibratorNode::~CalibratorNode() { stop(); }

void CalibratorNode::advertise(const char* service, std::function<Answer()> answer) {
  using Trigger = std_srvs::Trigger;
  const boost::function<bool(Trigger::Request&, Trigger::Response&)> callback =
      [answer = std::move(answer)](Trigger::Request&, Trigger::Response& response) {
        const Answer given = answer();
        response.success = given.success;
        response.message = given.message;
        return true;
      };
  services_.push_back(own_.advertiseService(service, callback));
}

void CalibratorNode::stop() {
  const std::lock_guard<std::mutex> lock(stop_mutex_);
  watching_.stop();
  solver_.stop();
  screen_.show(calib::Shown::Black);
}

void CalibratorNode::tell(const std::string& text) {
  if (!session_.tell(text)) ROS_WARN("%s", text.c_str());
}

// ------------------------------------------------------------------------------------- watching

void CalibratorNode::watch() {
  try {
    std::optional<CameraImage> image = camera_.take(goOnTiming());
    takeSolution();
    if (image && timing_) timing_->see(*image);
    if (image) onImage(std::move(*image));
    startSolving();
  } catch (const std::exception& error) {  // a full disk, a hostile message: the next may do
    image_problem_ = error.what();
  }
  showAndSay();
}

void CalibratorNode::onImage(CameraImage image) {
  if (!isUsable(image) || !session_.takesViews()) return;
  const auto seen = session_.see(views_->look(image.picture, image.stamp_ns));
  if (!seen) return;
  screen_.show(seen->shown);
  views_->keep(seen->answer.keep, seen->view_name, std::move(image.picture));
  const auto& T_camera_board = seen->answer.T_camera_board;
  if (seen->answer.is_complete && T_camera_board) finishView(*T_camera_board);
}

bool CalibratorNode::isUsable(const CameraImage& image) {
  const std::optional<calib::Lens> camera = camera_.lens();
  if (!camera) return false;
  image_problem_.clear();
  if (camera->width != image.picture.width || camera->height != image.picture.height) {
    image_problem_ =
        fmt::format("the camera's pictures are {}x{} but its camera_info is for {}x{}: calibrate "
                    "the camera at the resolution in use",
                    image.picture.width, image.picture.height, camera->width, camera->height);
    return false;
  }
  std::string& camera_frame = facts_.names.camera_frame;
  if (!options_.camera_frame.empty()) {
    camera_frame = options_.camera_frame;
  } else if (!image.frame_id.empty()) {
    camera_frame = image.frame_id;
  }
  if (session_.awaitsCamera()) {
    views_.emplace(*facts_.board, *facts_.pattern, *camera);
    session_.begin(*camera);
    folder_.keepCamera(*camera);
  }
  return true;
}

void CalibratorNode::finishView(const Rigid<Camera, Surface>& T_camera_board) {
  const calib::View view = views_->read();
  if (session_.isVerifying()) return finishCheck(view);
  session_.addView(view, T_camera_board, views_->photographs());
}

void CalibratorNode::finishCheck(const calib::View& view) {
  const std::optional<calib::Calibration> calibration = session_.calibration();
  if (!calibration) return;
  const calib::ViewCheck check = views_->check(view, *calibration);
  const calib::ErrorSummary errors = calib::summarize(check.errors);
  const bool is_wanted = session_.addCheck(errors, check.fault);
  if (is_wanted && errors.corners > 0) folder_.saveCheck(errors, views_->photographs());
}

// -------------------------------------------------------------------------------------- solving

void CalibratorNode::startSolving() {
  if (solver_.isRunning()) return;  // perhaps one that was given up by ~start
  if (auto task = session_.task()) solver_.start(std::move(*task), views_->camera());
}

void CalibratorNode::takeSolution() {
  const auto solution = solver_.take();
  if (!solution || !session_.awaitsSolution(solution->task.start)) return;
  if (!solution->calibration) return session_.refused(solution->task.start, solution->reasons);
  const calib::Calibration& calibration = *solution->calibration;
  std::string filed = "saved in " + options_.out;
  try {
    folder_.save(calibration, solution->task.photographs, facts_);
  } catch (const std::exception& error) {
    filed = "not saved: " + std::string(error.what());
  }
  topics_.publishCalibration(calibration.estimate, facts_.names);
  session_.solved(solution->task.start, calibration, filed);
}

// --------------------------------------------------------------------------------------- timing

std::chrono::nanoseconds CalibratorNode::goOnTiming() {
  if (!session_.isTiming()) {
    timing_.reset();
    return kImagePatience;
  }
  try {
    if (!timing_) timing_.emplace(screen_, options_.led);
    const std::chrono::nanoseconds until = timing_->goOn();
    if (!timing_->isDone()) return std::min<std::chrono::nanoseconds>(until, kImagePatience);
    finishTiming();
  } catch (const std::exception& error) {
    session_.timed(std::nullopt,
                   "the projector's delay is not measured: " + std::string(error.what()));
  }
  timing_.reset();
  return kImagePatience;
}

void CalibratorNode::finishTiming() {
  const calib::ProjectorDelay delay = timing_->delay(options_.stamps);
  std::string words = calib::delayWords(timing_->seen(), delay);
  if (!options_.config.empty()) {
    writeLatency(options_.config, options_.config_name, delay.ms);
    words += " It is latency_ms in " + options_.config + " now.";
  }
  session_.timed(delay.ms, words);
}

// --------------------------------------------------------------------------------------- saying

void CalibratorNode::showAndSay() {
  std::string problem = camera_.problem();
  if (problem.empty()) problem = image_problem_;
  const CalibrationSession::News news = session_.takeNews();
  if (!timing_) screen_.show(news.shown);
  for (const calib::Utterance& utterance : news.utterances) topics_.say(utterance, news.progress);
  topics_.complain(problem);
  CalibratorState state = session_.state();
  state.problem = problem;
  state.doing = solver_.progress();
  topics_.show(state);
}

}  // namespace afterglow::nodes

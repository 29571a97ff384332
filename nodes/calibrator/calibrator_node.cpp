#include "nodes/calibrator/calibrator_node.hpp"

#include <fmt/format.h>
#include <ros/names.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <boost/function.hpp>
#include <chrono>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>

#include "calib/camera_info_file.hpp"
#include "calib/targets/target_files.hpp"
#include "nodes/projector/output_config.hpp"

namespace afterglow::nodes {
namespace {

/// param() would silently give the default for a value of another type.
template <typename Value>
void take(const ros::NodeHandle& own, const std::string& name, Value& value) {
  if (own.hasParam(name) && !own.getParam(name, value)) {
    throw std::runtime_error("parameter ~" + name + " has a value of the wrong type");
  }
}

template <typename Value>
void check(const std::string& name, Value value, Value lowest, Value highest,
           const std::string& range) {
  if (!(value >= lowest && value <= highest)) {
    throw std::runtime_error("parameter ~" + name + " should be " + range);
  }
}

std::int64_t nanoseconds(double seconds) { return std::llround(seconds * 1e9); }

void readGuide(const ros::NodeHandle& own, calib::GuideOptions& guide) {
  take(own, "views", guide.views);
  check("views", guide.views, 3, 1000, "from 3 to 1000");
  take(own, "coverage", guide.coverage);
  check("coverage", guide.coverage, 0.0, 1.0, "a share from 0 to 1");
  double still_s = 0.5, patience_s = 4;
  take(own, "still_seconds", still_s);
  check("still_seconds", still_s, 0.0, 60.0, "from 0 to 60 s");
  take(own, "patience_seconds", patience_s);
  check("patience_seconds", patience_s, 0.1, 600.0, "from 0.1 to 600 s");
  guide.taker.still_ns = nanoseconds(still_s);
  guide.taker.patience_ns = nanoseconds(patience_s);
  take(own, "still_pixels", guide.taker.still_px);
  check("still_pixels", guide.taker.still_px, 0.01, 100.0, "from 0.01 to 100 px");
  take(own, "settle_frames", guide.taker.settle_images);
  check("settle_frames", guide.taker.settle_images, 0, 1000, "from 0 to 1000");
}

render::Mirror readMirror(const ros::NodeHandle& own) {
  std::string name = render::kMirrorNames.front();
  take(own, "mirror", name);
  const auto& names = render::kMirrorNames;
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) {
    throw std::runtime_error("parameter ~mirror should be none, horizontal, vertical or both");
  }
  return static_cast<render::Mirror>(found - names.begin());
}

void readLatency(const ros::NodeHandle& own, CalibratorOptions& options) {
  options.guide.times_delay = true;
  take(own, "latency", options.guide.times_delay);
  take(own, "config_file", options.config);
  take(own, "config_name", options.config_name);
  take(own, "led_file", options.led);
  std::string stamps;
  take(own, "image_stamps", stamps);
  if (stamps.empty()) return;
  const auto& names = calib::kStampNames;
  const auto found = std::find(names.begin(), names.end(), stamps);
  if (found == names.end()) {
    throw std::runtime_error("parameter ~image_stamps should be start, middle or end");
  }
  options.stamps = static_cast<calib::StampMeaning>(1 + (found - names.begin()));
}

calib::CameraUse readCameraUse(const ros::NodeHandle& own) {
  bool is_refined = false, is_fixed = false;
  take(own, "refine_camera", is_refined);
  take(own, "fix_camera", is_fixed);
  if (is_refined && is_fixed) {
    throw std::runtime_error("parameters ~refine_camera and ~fix_camera exclude each other");
  }
  if (is_fixed) return calib::CameraUse::Hold;
  return is_refined ? calib::CameraUse::Refine : calib::CameraUse::RefineIfContradicted;
}

}  // namespace

CalibratorOptions CalibratorOptions::read(const ros::NodeHandle& own) {
  CalibratorOptions options;
  take(own, "board_file", options.board);
  if (options.board.empty()) {
    throw std::runtime_error(
        "parameter ~board_file is missing: the board.yaml that `afterglow calibrate board` wrote");
  }
  take(own, "out", options.out);
  if (options.out.empty()) {
    throw std::runtime_error("parameter ~out is missing: the folder for the calibration");
  }
  take(own, "pattern_file", options.pattern);
  take(own, "width", options.width);
  take(own, "height", options.height);
  if (options.pattern.empty() && (options.width == 0 || options.height == 0)) {
    throw std::runtime_error(
        "parameter ~pattern_file (a pattern.yaml), or ~width and ~height of the projector's "
        "picture "
        "are missing");
  }
  options.image_topic = "/camera/image_raw";
  take(own, "image_topic", options.image_topic);
  take(own, "camera_info_topic", options.camera_info_topic);
  if (options.camera_info_topic.empty()) {
    const std::string image = ros::names::resolve(options.image_topic);
    options.camera_info_topic = ros::names::parentNamespace(image) + "/camera_info";
    options.camera_info_topic = ros::names::clean(options.camera_info_topic);
  }
  take(own, "camera_info_file", options.camera_info);
  readGuide(own, options.guide);
  if (own.hasParam("measured_ruler")) {
    options.measured_ruler_m.emplace();
    take(own, "measured_ruler", *options.measured_ruler_m);
    check("measured_ruler", *options.measured_ruler_m, 0.005, 5.0, "the ruler's length in meters");
  }
  options.camera_use = readCameraUse(own);
  readLatency(own, options);
  take(own, "autostart", options.is_started);
  take(own, "speak", options.is_spoken);
  take(own, "publish_transform", options.publishes_transform);
  take(own, "camera_frame", options.camera_frame);
  take(own, "projector_frame", options.names.projector_frame);
  take(own, "projector_name", options.names.projector_name);
  options.window = WindowChoice::read(own);
  options.mirror = readMirror(own);
  return options;
}

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

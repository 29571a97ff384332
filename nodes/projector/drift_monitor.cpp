#include "nodes/projector/drift_monitor.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <tf2/exceptions.h>

#include <algorithm>
#include <exception>
#include <variant>
#include <vector>

#include "calib/camera_info_file.hpp"
#include "calib/number_text.hpp"
#include "nodes/conversion/camera_messages.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/diagnostics.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kDecimation = 2;  // fast; its error is less than a drift worth a warning
constexpr int kNiceness = 10;      // drawing comes first
constexpr double kLeastPatience_s = 2;
constexpr std::chrono::milliseconds kTransformPatience(500), kPoll(20);

using calib::fixedText;
using diagnostic_msgs::DiagnosticStatus;

std::string offsetText(double px, double mm) {
  return fixedText(px, 1) + " px, " + fixedText(mm, 1) + " mm";
}

std::string limitText(const WatchConfig& config) {
  std::string text;
  if (config.limit_px) text = fixedText(*config.limit_px, 1) + " px";
  if (config.limit_mm) text += (text.empty() ? "" : ", ") + fixedText(*config.limit_mm, 1) + " mm";
  return text;
}

void judge(const WatchConfig& config, const calib::Drift& drift, DiagnosticStatus& status) {
  const std::string seen = std::to_string(drift.seen.size());
  if (drift.seen.empty()) {
    status.level = DiagnosticStatus::STALE;
    status.message = drift.expected == 0 ? "no known tag should be in the camera's view now"
                                         : "none of the " + std::to_string(drift.expected) +
                                               " tags that should be in the camera's view is seen";
    return;
  }
  const bool has_drifted = (config.limit_px && drift.median_px > *config.limit_px) ||
                           (config.limit_mm && drift.median_mm > *config.limit_mm);
  const std::string offset = offsetText(drift.median_px, drift.median_mm);
  status.level = has_drifted ? DiagnosticStatus::WARN : DiagnosticStatus::OK;
  status.message = has_drifted ? "drift: " + seen + " tags are off by " + offset + " (limit " +
                                     limitText(config) + "); localize the robot, or calibrate again"
                               : seen + " tags within " + offset;
}

}  // namespace

DriftMonitor::DriftMonitor(const WatchConfig& config, const tf2::BufferCore& transforms)
    : config_(config),
      transforms_(transforms),
      detector_(config.layout.family, kDecimation),
      looked_at_(Clock::now()),
      thread_(std::chrono::duration_cast<Clock::duration>(
                  std::chrono::duration<double>(config_.period_s)),
              [this] { run(); }) {
  newest_.problem = "has not looked yet";
  if (const auto* file = std::get_if<CameraFile>(&config_.camera_info)) {
    camera_ = calib::loadCameraInfo(file->path).lens;
  }
  nh_.setCallbackQueue(&queue_);
  thread_.begin();
}

diagnostic_msgs::DiagnosticStatus DriftMonitor::status(const std::string& node) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::chrono::duration<double> age = Clock::now() - looked_at_;
  return watchStatus(node, config_, newest_, age.count());
}

void DriftMonitor::run() {
  setpriority(PRIO_PROCESS, 0, kNiceness);  // on Linux: of this thread
  WatchLook found;
  try {
    found = look();
  } catch (const std::exception& error) {  // pictures and lenses come from the network
    found.problem = error.what();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  newest_ = std::move(found);
  looked_at_ = Clock::now();
}

std::string DriftMonitor::waitForCamera() {
  image_.reset();
  camera_info_.reset();
  const boost::function<void(const sensor_msgs::ImageConstPtr&)> take_image =
      [this](const sensor_msgs::ImageConstPtr& message) { image_ = message; };
  const boost::function<void(const sensor_msgs::CameraInfoConstPtr&)> take_info =
      [this](const sensor_msgs::CameraInfoConstPtr& message) { camera_info_ = message; };
  const auto images = nh_.subscribe<sensor_msgs::Image>(config_.image_topic, 1, take_image);
  ros::Subscriber infos;
  const auto* info_topic = std::get_if<CameraTopic>(&config_.camera_info);
  if (info_topic != nullptr) {
    infos = nh_.subscribe<sensor_msgs::CameraInfo>(info_topic->name, 1, take_info);
  }
  const double patience_s = std::max(kLeastPatience_s, config_.period_s);
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(patience_s));
  const auto lacks_info = [&] { return info_topic != nullptr && !camera_info_; };
  while (!image_ || lacks_info()) {
    queue_.callAvailable();
    if (image_ && !lacks_info()) break;
    if (Clock::now() > end || !thread_.sleepUntil(Clock::now() + kPoll)) {
      return "nothing on " + (image_ ? info_topic->name : config_.image_topic) + " for " +
             calib::fixedText(patience_s, 0) + " s";
    }
  }
  if (camera_info_) camera_ = toLens(*camera_info_);
  return {};
}

std::optional<Rigid<Camera, Surface>> DriftMonitor::cameraPose(
    const std_msgs::Header& header) const {
  const std::string camera = frameName(header.frame_id);
  const auto end = Clock::now() + kTransformPatience;
  try {
    while (!transforms_.canTransform(camera, config_.layout.frame, header.stamp)) {
      if (Clock::now() > end || !thread_.sleepUntil(Clock::now() + kPoll)) return std::nullopt;
    }
    return Rigid<Camera, Surface>(toIsometry(
        transforms_.lookupTransform(camera, config_.layout.frame, header.stamp).transform));
  } catch (const tf2::TransformException&) {
    return std::nullopt;
  }
}

WatchLook DriftMonitor::look() {
  WatchLook look;
  look.problem = waitForCamera();
  if (!look.problem.empty()) return look;
  look.problem = headerFault(image_->header);
  if (!look.problem.empty()) {
    look.problem = config_.image_topic + ": " + look.problem;
    return look;
  }
  const calib::Picture picture = toPicture(*image_);
  if (picture.width != camera_->width || picture.height != camera_->height) {
    look.problem = fmt::format("{} is of {} x {} pixels, its camera_info of {} x {}",
                               config_.image_topic, picture.width, picture.height, camera_->width,
                               camera_->height);
    return look;
  }
  const auto T_camera_surface = cameraPose(image_->header);
  if (!T_camera_surface) {
    look.problem = "no transform from '" + config_.layout.frame + "' to the camera's frame '" +
                   printable(image_->header.frame_id) + "' at the time of its picture";
    return look;
  }
  const std::vector<calib::DetectedTag> found = detector_.detect(picture);
  look.drift = calib::driftOf(config_.layout.tags, {found.begin(), found.end()}, *T_camera_surface,
                              *camera_);
  return look;
}

diagnostic_msgs::DiagnosticStatus watchStatus(const std::string& node, const WatchConfig& config,
                                              const WatchLook& look, double age_s) {
  DiagnosticStatus status;
  status.name = node + ": drift watch";
  status.hardware_id = "projector";
  if (look.problem.empty()) {
    judge(config, look.drift, status);
  } else {
    status.level = DiagnosticStatus::STALE;
    status.message = look.problem;
  }
  addValue(status, "seen", std::to_string(look.drift.seen.size()));
  addValue(status, "expected", std::to_string(look.drift.expected));
  if (!look.drift.seen.empty()) {
    addValue(status, "median_px", fixedText(look.drift.median_px, 2));
    addValue(status, "median_mm", fixedText(look.drift.median_mm, 2));
  }
  addValue(status, "limit", limitText(config));
  addValue(status, "age_s", fixedText(age_s, 1));
  for (const calib::TagDrift& tag : look.drift.seen) {
    addValue(status, "tag " + std::to_string(tag.id), offsetText(tag.px, tag.mm));
  }
  return status;
}

}  // namespace afterglow::nodes

#include "nodes/calibrator/calibrator_options.hpp"

#include <ros/names.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

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

}  // namespace afterglow::nodes

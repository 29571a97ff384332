/// \file
/// calibrator_node's parameters.
#pragma once

#include <ros/node_handle.h>

#include <optional>
#include <string>

#include "calib/guide/guide.hpp"
#include "calib/latency/latency.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/solver/solve.hpp"
#include "nodes/tools/window_choice.hpp"
#include "render/light_output.hpp"

namespace afterglow::nodes {

/// No name here is that of a topic or service of the node: remapping one would move both.
struct CalibratorOptions {
  std::string board;        ///< ~board_file: board.yaml of the printed board
  std::string pattern;      ///< ~pattern_file: pattern.yaml; empty: the default one for
  int width = 0;            ///< ~width, px: and
  int height = 0;           ///< ~height, px: of the projector's picture
  std::string out;          ///< ~out: folder of the calibration
  std::string image_topic;  ///< ~image_topic (/camera/image_raw)
  /// ~camera_info_topic; empty: camera_info beside the image topic.
  std::string camera_info_topic;
  std::string camera_info;  ///< ~camera_info_file, instead of the topic
  /// ~views (16), ~coverage (0.5), ~still_seconds (0.5), ~still_pixels (0.5), ~settle_frames (2),
  /// ~patience_seconds (4)
  calib::GuideOptions guide;
  std::optional<double> measured_ruler_m;  ///< ~measured_ruler: of the print, in meters
  /// ~latency (true): measure the projector's delay (guide.times_delay). ~config_file: the
  /// configuration of projector_node that it is written to; empty: it is only told. ~config_name:
  /// the projector's name there, among several. ~led_file: LatencyMeasurement's. ~image_stamps
  /// (start, middle or end of the exposure): what the camera's driver stamps; empty: unknown.
  std::string config, config_name, led;
  calib::StampMeaning stamps = calib::StampMeaning::Unknown;
  /// ~refine_camera, ~fix_camera: as the options of `afterglow calibrate solve`
  calib::CameraUse camera_use = calib::CameraUse::RefineIfContradicted;
  bool is_started = true;            ///< ~autostart: at once, without the service
  bool is_spoken = true;             ///< ~speak: on /robotsound
  bool publishes_transform = false;  ///< ~publish_transform: camera to projector, on /tf_static
  std::string camera_frame;          ///< ~camera_frame; empty: the images'
  calib::CalibrationNames names;     ///< ~projector_frame, ~projector_name; camera_frame as above
  WindowChoice window;
  /// ~mirror (none, horizontal, vertical, both) of the window's picture: as in the configuration of
  /// projector_node (render::LightSettings says why).
  render::Mirror mirror = render::Mirror::None;

  /// Throws std::runtime_error naming the parameter that is missing or wrong.
  static CalibratorOptions read(const ros::NodeHandle& own);
};

}  // namespace afterglow::nodes

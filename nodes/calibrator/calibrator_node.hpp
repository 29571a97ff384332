/// \file
/// calibrator_node: a projector calibrated live, by a person who holds a printed board in its
/// light.
///
/// Topics in: the camera's image and camera_info (parameters name them). Out: ~pattern
/// (sensor_msgs/Image mono8, latched: what the projector has to show), ~guidance (std_msgs/String,
/// latched), ~status (std_msgs/String, JSON, latched), ~camera_info (sensor_msgs/CameraInfo of the
/// projector, latched, once solved), /robotsound, /diagnostics, /tf_static if asked.
/// Services (std_srvs/Trigger): ~start (from the beginning), ~stop, ~take (a view now, even if the
/// board moves or was held so before), ~solve (with the views there are), ~discard_last.
#pragma once

#include <ros/node_handle.h>
#include <ros/ros.h>

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "calib/guide/guide.hpp"
#include "calib/guide/view_taker.hpp"
#include "calib/latency/latency.hpp"
#include "calib/report/calibration_files.hpp"
#include "calib/solver/solve.hpp"
#include "nodes/calibrator/calibration_session.hpp"
#include "nodes/calibrator/calibrator_topics.hpp"
#include "nodes/calibrator/camera_subscriber.hpp"
#include "nodes/calibrator/pattern_screen.hpp"
#include "nodes/tools/calibration_folder.hpp"
#include "nodes/tools/window_choice.hpp"
#include "render/light_output.hpp"
#include "replay/clock/worker_thread.hpp"

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

/// Watches the camera from construction to stop() in a thread of its own; solving has another one.
/// Callbacks come from the caller's spinner.
class CalibratorNode {
 public:
  /// Throws std::runtime_error naming the file that is wrong.
  explicit CalibratorNode(const CalibratorOptions& options);
  ~CalibratorNode();

  /// Stops watching and solving; the last picture is black.
  void stop();
  PatternScreen& screen() { return screen_; }
  /// Said and shown like everything else.
  void tell(const std::string& text);

 private:
  CalibratorNode(const CalibratorOptions& options, const calib::Board& board,
                 const calib::Pattern& pattern);
  using Answer = CalibrationSession::Answer;
  void advertise(const char* service, std::function<Answer()> answer);

  void watch();
  void onImage(CameraImage image);
  /// Returns true if the camera's lens is known and of this image; begins the session if it waits
  /// for that.
  bool isUsable(const CameraImage& image);
  void finishView(const Rigid<Camera, Surface>& T_camera_board);
  void finishCheck(const calib::View& view);
  void startSolving();
  void takeSolution();
  /// Begins, or goes on with, the measurement of the delay; returns how long an image may be waited
  /// for.
  std::chrono::nanoseconds goOnTiming();
  void finishTiming();
  void showAndSay();

  const CalibratorOptions options_;
  const CalibrationFolder folder_;
  CalibrationSession session_;

  // The watching thread's own.
  std::optional<calib::ViewBuilder> views_;  ///< once the camera is known
  BackgroundSolver solver_;
  calib::ReportFacts facts_;
  std::optional<LatencyMeasurement> timing_;
  std::string image_problem_;  ///< empty: there is none

  std::mutex stop_mutex_;
  ros::NodeHandle own_{"~"};
  PatternScreen screen_;
  CalibratorTopics topics_;
  CameraSubscriber camera_;
  std::vector<ros::ServiceServer> services_;
  /// Last: it uses all of the above. camera_ sets its pace.
  replay::RepeatingThread watching_{std::chrono::nanoseconds(0), [this] { watch(); }};
};

}  // namespace afterglow::nodes

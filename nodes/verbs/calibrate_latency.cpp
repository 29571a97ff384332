#include "nodes/verbs/command.hpp"

#include <fmt/format.h>
#include <ros/ros.h>

#include <CLI/Error.hpp>
#include <CLI/Option.hpp>
#include <CLI/Validators.hpp>
#include <atomic>
#include <exception>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "calib/latency/latency.hpp"
#include "calib/targets/pattern.hpp"
#include "nodes/calibrator/camera_subscriber.hpp"
#include "nodes/calibrator/pattern_screen.hpp"
#include "nodes/calibrator/pattern_window.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "nodes/verbs/verb_node.hpp"
#include "nodes/verbs/verb_tools.hpp"

namespace afterglow::nodes {
namespace {

struct CalibrateLatencyOptions {
  std::string config, calibration, name;
  std::string image = "/camera/image_raw";
  std::string monitor;
  std::string led;
  std::string stamps;
  bool is_kept = false;
  bool json = false;
};

/// Measures in a thread of its own: the window is the main thread's.
class LatencyThread {
 public:
  LatencyThread(PatternScreen& screen, const CalibrateLatencyOptions& options)
      : screen_(screen),
        camera_(options.image, "", std::nullopt),
        measurement_(screen, options.led) {
    thread_ = std::thread([this] { run(); });
  }
  ~LatencyThread() { stop(); }
  LatencyThread(const LatencyThread&) = delete;
  LatencyThread& operator=(const LatencyThread&) = delete;

  bool isOver() const { return is_over_; }
  /// Leaves the screen black.
  void stop() {
    is_over_ = true;
    if (thread_.joinable()) thread_.join();
    screen_.show(calib::Shown::Black);
  }
  /// The measurement, after stop(). Throws why there is none.
  const LatencyMeasurement& result() const {
    if (failure_) std::rethrow_exception(failure_);
    if (!measurement_.isDone()) throw std::runtime_error("stopped before it was measured");
    return measurement_;
  }

 private:
  void run() {
    try {
      while (!is_over_ && !measurement_.isDone()) {
        const auto image = camera_.take(measurement_.goOn());
        if (image) measurement_.see(*image);
        const std::string problem = camera_.problem();
        if (!problem.empty()) throw std::runtime_error(problem);
      }
    } catch (...) {
      failure_ = std::current_exception();
    }
    is_over_ = true;
  }

  PatternScreen& screen_;
  CameraSubscriber camera_;
  LatencyMeasurement measurement_;
  std::atomic<bool> is_over_{false};
  std::exception_ptr failure_;
  std::thread thread_;
};

nlohmann::ordered_json latencyJson(const calib::SeenDelay& seen,
                                   const calib::ProjectorDelay& delay) {
  return {{"latency_ms", delay.ms},
          {"bound_ms", delay.bound_ms},
          {"basis", delay.basis},
          {"seen_ms", seen.ms},
          {"seen_uncertainty_ms", seen.uncertainty_ms},
          {"exposure_ms", seen.exposure_ms},
          {"exposure_uncertainty_ms", seen.exposure_uncertainty_ms},
          {"spread_ms", seen.spread_ms},
          {"rows_ms", seen.rows_ms},
          {"arrival_ms", seen.arrival_ms},
          {"frame_hz", seen.frame_hz},
          {"changes", seen.changes},
          {"images", seen.images}};
}

/// Shows light on and off until the delay is measured; ends with a black screen.
void measure(const OutputConfig& projector, const CalibrateLatencyOptions& options,
             std::optional<LatencyThread>& thread, PatternScreen& screen) {
  thread.emplace(screen, options);
  const WindowChoice choice{WindowMode::Auto,
                            options.monitor.empty() ? projector.monitor : options.monitor};
  PatternWindow{choice, projector.light.mirror,
                [&] { return ros::ok() && !isStopRequested() && !thread->isOver(); },
                [](const std::string& text) { std::cerr << text << std::endl; },
                [&] { thread->stop(); }}
      .show(screen);
}

void runLatency(const CalibrateLatencyOptions& options) {
  const ProjectorConfig config = loadProjectorConfig(options.config, options.calibration);
  const OutputConfig& projector = projectorNamed(config, options.config, options.name);
  const calib::Lens lens = loadLens(projector).lens;
  startVerbNode("afterglow_calibrate");
  printWarningsOnly();
  catchStopSignals();
  const ros::NodeHandle node;
  ros::AsyncSpinner spinner(1);
  spinner.start();
  PatternScreen screen(calib::makePattern(lens.width, lens.height), projector.frame,
                       "projector/pattern");
  std::optional<LatencyThread> thread;
  std::optional<Waiting> waiting(std::in_place, "measuring the delay of light");
  measure(projector, options, thread, screen);
  letMessagesLeave();
  waiting.reset();
  const auto stamps =
      std::find(calib::kStampNames.begin(), calib::kStampNames.end(), options.stamps);
  const auto meaning =
      options.stamps.empty()
          ? calib::StampMeaning::Unknown
          : static_cast<calib::StampMeaning>(1 + (stamps - calib::kStampNames.begin()));
  const LatencyMeasurement& result = thread->result();
  const calib::ProjectorDelay delay = result.delay(meaning);
  if (!options.is_kept) writeLatency(options.config, projector.name, delay.ms);
  if (options.json) {
    std::cout << dumpJson(latencyJson(result.seen(), delay), 2) << "\n";
    return;
  }
  std::cout << calib::delayWords(result.seen(), delay) << "\n";
  if (!options.is_kept) {
    std::cout << fmt::format("latency_ms: {:.1f} in {}\n", delay.ms, options.config);
  }
}

}  // namespace

void addCalibrateLatency(CLI::App& calibrate) {
  auto options = std::make_shared<CalibrateLatencyOptions>();
  CLI::App* verb = calibrate.add_subcommand(
      "latency",
      "Measure a projector's delay with a camera that sees its light, and write latency_ms");
  verb->add_option("--config", options->config,
                   "The configuration of projector_node, which must not run meanwhile")
      ->required();
  verb->add_option("--calibration", options->calibration,
                   "Folder of the lens's file; default: that of the configuration");
  verb->add_option("--projector", options->name, "Which one, where the configuration has several");
  verb->add_option("--image", options->image, "The camera's topic")->capture_default_str();
  verb->add_option("--monitor", options->monitor,
                   "The projector's screen; default: the configuration's. Without a display "
                   "/projector/pattern alone has the pictures");
  verb->add_option("--led", options->led,
                   "A file that a light follows which the camera sees, too: 1 and 0 are written to "
                   "it (/sys/class/leds/NAME/brightness, a serial port). Tells the camera's own "
                   "delay apart");
  verb->add_option("--stamps", options->stamps,
                   "What images are stamped at, of their exposure; without it: anywhere in it")
      ->check(CLI::IsMember(calib::kStampNames));
  verb->add_flag("--keep", options->is_kept, "Only tell it: the configuration is kept");
  verb->add_flag("--json", options->json, "What was measured, as JSON");
  verb->callback([options] { runLatency(*options); });
}

}  // namespace afterglow::nodes

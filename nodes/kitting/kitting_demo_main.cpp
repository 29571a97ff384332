// kitting_demo OUT ASSETS: directs the demo among the nodes of nodes/launch/demo.launch and writes
// its report. nodes/run_demo starts it all.
#include <fmt/format.h>
#include <ros/console.h>
#include <ros/ros.h>
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>

#include "calib/file_replacement.hpp"
#include "nodes/kitting/demo_director.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace {

using namespace afterglow::nodes;
namespace calib = afterglow::calib;
namespace fs = std::filesystem;

constexpr int kFailed = 1, kUsage = 2;

// As people type it into a shell: relative where that is shorter, quoted where it must be.
std::string typed(const fs::path& path) {
  const std::string relative = fs::relative(path).string();
  const std::string text = relative.size() < path.string().size() ? relative : path.string();
  return text.find(' ') == std::string::npos ? text : "'" + text + "'";
}

DemoFiles filesOf(const fs::path& out, const fs::path& assets) {
  DemoFiles files;
  files.assets = assets.string();
  files.out = fs::absolute(out).string();
  files.store = (fs::absolute(out) / "demo.db").string();
  files.typed_out = typed(fs::absolute(out));
  files.typed_assets = typed(fs::absolute(assets));
  files.typed_command = typed(fs::canonical("/proc/self/exe").parent_path() / "afterglow");
  return files;
}

void printSummary(const DemoReport& report, DemoProgress& progress) {
  progress.line("");
  progress.line(fmt::format("{:<8} {:>9} {:>9} {:>8} {:>14}  {}", "behavior", "recorded",
                            "messages", "dropped", "p99 lateness", "replay ended off by"));
  for (const MeasuredBehavior& each : report.behaviors) {
    const EndError error = endError(each.live_end, each.replay_end);
    progress.line(fmt::format(
        "{:<8} {:>7.1f} s {:>9} {:>8} {:>11.2f} ms  {:.1f} cm, {:.1f} degrees", each.behavior.name,
        durationOf(each.behavior), each.messages, each.dropped,
        latenessOf(each.player_report).p99_ms, error.base_cm, error.heading_deg));
  }
  progress.line("");
  progress.line("Video    " + report.folder + "/" + report.video);
  progress.line("Report   " + report.folder +
                "/report.html   (numbers: summary.json, pictures: frames/)");
  progress.line("");
  progress.line("Try on what was recorded:");
  for (const std::string& command : commandsToTry(report)) progress.line("  " + command);
}

void direct(const DemoFiles& files, DemoProgress& progress) {
  DemoDirector director(files, progress);
  progress.title(director.story().title, director.story().subtitle);
  const DemoReport report = director.run();
  const fs::path out(files.out);
  calib::replaceFile((out / "summary.json").string(), summaryJson(report).dump(2) + "\n");
  calib::replaceFile((out / "report.html").string(), reportHtml(report, director.story()));
  printSummary(report, progress);
}

// Stops what runs when the user does; the robot's own nodes are somebody else's.
void followStopSignals() {
  static ros::WallTimer timer =
      ros::NodeHandle().createWallTimer(ros::WallDuration(0.1), [](const ros::WallTimerEvent&) {
        if (isStopRequested()) ros::requestShutdown();
      });
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "kitting_demo", ros::init_options::NoSigintHandler);
  if (argc != 3) {
    std::cerr << "usage: kitting_demo OUT ASSETS\n";
    return kUsage;
  }
  catchStopSignals();
  // Goals that overtake each other are the turret's daily bread; actionlib complains of each.
  ros::console::set_logger_level("ros.afterglow.actionlib", ros::console::levels::Fatal);
  ros::console::notifyLoggerLevelsChanged();
  DemoProgress progress(stdout, isatty(STDOUT_FILENO) != 0);
  try {
    if (!ros::master::check()) {
      throw std::runtime_error("no ROS master at " + ros::master::getURI());
    }
    ros::AsyncSpinner spinner(3);
    spinner.start();
    followStopSignals();
    direct(filesOf(argv[1], argv[2]), progress);
    spinner.stop();
  } catch (const std::exception& error) {
    progress.failed();
    std::cerr << "kitting_demo: " << error.what() << "\n";
    return kFailed;
  }
  return 0;
}

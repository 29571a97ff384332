// kitting_demo OUT ASSETS: directs the demo among the nodes of nodes/launch/demo.launch and writes
// its report. nodes/run_demo starts it all.
#include <fmt/format.h>
#include <ros/ros.h>

#include <exception>
#include <filesystem>
#include <iostream>

#include "calib/file_replacement.hpp"
#include "nodes/kitting/demo_director.hpp"
#include "nodes/tools/ros_graph.hpp"

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

void printSummary(const DemoReport& report) {
  std::cout << fmt::format("\n{:<8} {:>9} {:>9} {:>8} {:>14}  {}\n", "behavior", "recorded",
                           "messages", "dropped", "p99 lateness", "replay ended off by");
  for (const MeasuredBehavior& each : report.behaviors) {
    const EndError error = endError(each.live_end, each.replay_end);
    std::cout << fmt::format(
        "{:<8} {:>7.1f} s {:>9} {:>8} {:>11.2f} ms  {:.1f} cm, {:.1f} degrees\n",
        each.behavior.name, durationOf(each.behavior), each.messages, each.dropped,
        latenessOf(each.player_report).p99_ms, error.base_cm, error.heading_deg);
  }
  std::cout << "\nVideo    " << report.folder << "/" << report.video << "\nReport   "
            << report.folder << "/report.html   (numbers: summary.json, pictures: frames/)\n"
            << "\nTry on what was recorded:\n";
  for (const std::string& command : commandsToTry(report)) std::cout << "  " << command << "\n";
}

void direct(const fs::path& out, const fs::path& assets) {
  DemoDirector director({assets.string(), out.string()});
  std::cout << director.story().title << ": " << director.story().subtitle << std::endl;
  DemoReport report = director.run();
  report.folder = typed(out);
  report.assets = typed(assets);
  report.command = typed(fs::canonical("/proc/self/exe").parent_path() / "afterglow");
  calib::replaceFile((out / "summary.json").string(), summaryJson(report).dump(2) + "\n");
  calib::replaceFile((out / "report.html").string(), reportHtml(report, director.story()));
  printSummary(report);
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "kitting_demo");
  if (argc != 3) {
    std::cerr << "usage: kitting_demo OUT ASSETS\n";
    return kUsage;
  }
  try {
    if (!ros::master::check()) {
      throw std::runtime_error("no ROS master at " + ros::master::getURI());
    }
    ros::AsyncSpinner spinner(3);
    spinner.start();
    direct(fs::absolute(argv[1]), fs::absolute(argv[2]));
    spinner.stop();
  } catch (const std::exception& error) {
    std::cerr << "kitting_demo: " << error.what() << "\n";
    return kFailed;
  }
  return 0;
}

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include "nodes/player/robot_file.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/setup_files.hpp"
#include "nodes/verbs/verb_node.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {
namespace {

namespace fs = std::filesystem;

constexpr double kInitListens = 4;  // s: what is shown now and then is silent meanwhile

struct InitOptions {
  std::string robot, store, calibration, out;
};

/// Made if it is not there. Throws std::runtime_error for one that holds something.
void prepareFolder(const std::string& out) {
  std::error_code error;
  fs::create_directories(out, error);
  if (error) throw std::runtime_error(out + ": cannot be made: " + error.message());
  if (!fs::is_empty(out, error) || error) {
    const std::string why =
        error ? error.message() : "the folder is not empty, and stays as it is";
    throw std::runtime_error(out + ": " + why);
  }
}

void write(const fs::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw std::runtime_error(path.string() + ": cannot be written");
  std::cout << path.string() << "\n";
}

std::string absolute(const std::string& path) {
  return path.empty() ? path : fs::absolute(path).lexically_normal().string();
}

/// The launch file is started from anywhere, and a password stands in no file of ours.
std::string storeWords(const std::string& store) {
  if (store.empty()) return store;
  if (store[0] == '@') return "@" + absolute(store.substr(1));
  const std::string full = replay::fullStoreUri(store);
  if (replay::isServerUri(full)) {
    replay::refusePassword("the launch file", store);
    return full;
  }
  return "sqlite:" + absolute(replay::storePath(full));
}

SetupWords wordsOf(const InitOptions& options) {
  const bool is_file = options.robot.find('/') != options.robot.npos ||
                       fs::path(options.robot).extension() == ".yaml";
  return {is_file ? absolute(options.robot) : options.robot, storeWords(options.store),
          absolute(options.calibration)};
}

void runInit(const InitOptions& options) {
  replay::RobotProfile robot;
  if (!options.robot.empty()) {
    robot = withNames(findRobotProfile(options.robot), {rosNamespace(), ""});
  }
  const SetupWords words = wordsOf(options);
  startVerbNode("afterglow_init");
  prepareFolder(options.out);
  catchStopSignals();
  const Deadline soon = deadlineIn(kMasterPatience);
  std::vector<std::string> topics = projectableTopics(askMaster(soon), askTopicTypes(soon));
  const RunningRobot running = [&] {
    const Waiting waiting("listening to the robot");
    return listenToRobot(robot, std::move(topics), {}, kInitListens);
  }();
  robot = withNames(robot, running.names);
  if (isStopRequested()) throw std::runtime_error("interrupted; nothing is written");
  const fs::path config = fs::path(options.out) / "projector.yaml";
  write(config, projectorYaml(robot, running));
  // What is written has to be understood.
  loadProjectorConfig(config, words.calibration.empty() ? fs::path(options.out) / "calibration"
                                                        : fs::path(words.calibration));
  write(fs::path(options.out) / "robot.launch", robotLaunch(robot, running, words));
  std::cout << "To be checked:\n";
  for (const std::string& thing : thingsToCheck(robot, running)) std::cout << "- " << thing << "\n";
  std::cout << "Then: roslaunch " << (fs::path(options.out) / "robot.launch").string() << "\n";
}

}  // namespace

void addInitVerb(CLI::App& app) {
  const auto options = std::make_shared<InitOptions>();
  CLI::App* verb = addVerb(app, "init");
  verb->add_option("--out", options->out,
                   "Folder for projector.yaml and robot.launch; made if it is not there, refused "
                   "if it holds something")
      ->required();
  verb->add_option("--robot", options->robot,
                   "What is known of the robot: a name or a file, as --robot of play");
  verb->add_option("--calibration", options->calibration,
                   "The folder that calibrate.launch filled; default: calibration, below --out");
  addStoreOption(*verb, options->store);
  verb->callback([options] { runInit(*options); });
}

}  // namespace afterglow::nodes

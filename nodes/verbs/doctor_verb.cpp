#include <fmt/format.h>
#include <ros/master.h>

#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "nodes/player/robot_file.hpp"
#include "nodes/tools/ros_graph.hpp"
#include "nodes/tools/stop_signal.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/machine_checks.hpp"
#include "nodes/verbs/robot_checks.hpp"
#include "nodes/verbs/verb_node.hpp"
#include "nodes/verbs/verb_tools.hpp"

namespace afterglow::nodes {
namespace {

/// Scans and joint states come several times in it; amcl repeats itself ten times a second.
constexpr double kDoctorListens = 2.5;  // s

struct DoctorOptions {
  std::string robot, store, config, calibration;
  bool json = false;
};

/// Tells the checks in their order; each is told as soon as it is known.
class Doctor {
 public:
  explicit Doctor(bool is_json) : is_json_(is_json) {}

  void tell(Checkup finding) {
    if (!is_json_) std::cout << finding.words() << std::endl;
    findings_.push_back(std::move(finding));
  }
  void tell(const std::vector<Checkup>& findings) {
    for (const Checkup& finding : findings) tell(finding);
  }
  /// Throws std::runtime_error if there are problems.
  void end() const {
    const std::size_t problems = countOf(Checkup::Level::Problem, findings_);
    if (is_json_) print(problems);
    if (problems == 0) return;
    throw std::runtime_error(fmt::format("{} of {} checks {}", problems, findings_.size(),
                                         problems == 1 ? "is a problem" : "are problems"));
  }

 private:
  void print(std::size_t problems) const {
    nlohmann::ordered_json json;
    json["ok"] = problems == 0;
    json["checks"] = nlohmann::ordered_json::array();
    for (const Checkup& finding : findings_) json["checks"].push_back(finding.json());
    std::cout << dumpJson(json, 2) << "\n";
  }

  const bool is_json_;
  std::vector<Checkup> findings_;
};

/// Checks the machine without ROS, while this process has one thread.
void checkMachine(const DoctorOptions& options, Doctor& doctor) {
  doctor.tell(checkGpu());
  std::vector<WantedMonitor> wanted;
  if (!options.config.empty()) {
    const ConfigurationCheck check = checkConfiguration(options.config, options.calibration);
    doctor.tell(check.finding);
    wanted = check.wanted;
  }
  doctor.tell(checkMonitors(wanted));
  doctor.tell(checkRealtime());
  doctor.tell(checkOwnClock());
  doctor.tell(checkSound());
  doctor.tell(checkStore(options.store));
  doctor.tell(checkDisk(options.store));
}

/// The master; then the clock of its machine, which is the robot's, as far as is known.
std::optional<RunningRobot> findRobot(const replay::RobotProfile& robot, Doctor& doctor) {
  const char* const name = "master";
  try {
    startVerbNode("afterglow_doctor");
    doctor.tell(Checkup::ok(name, "answers at " + ros::master::getURI()));
    doctor.tell(checkRobotClock(ros::master::getHost()));
    return listenToRobot(robot, topicsToHear(robot),
                         {replay::RobotNames{rosNamespace(), ""}.topic(kGuardNode)}, kDoctorListens);
  } catch (const std::exception& error) {
    const char* const advice = "start roscore or the robot, or set ROS_MASTER_URI";
    doctor.tell(robot.name.empty() ? Checkup::advise(name, error.what(), advice)
                                   : Checkup::problem(name, error.what(), advice));
    return std::nullopt;
  }
}

void runDoctor(const DoctorOptions& options) {
  replay::RobotProfile robot;
  if (!options.robot.empty()) {
    robot = withNames(findRobotProfile(options.robot), {rosNamespace(), ""});
  }
  catchStopSignals();
  Doctor doctor(options.json);
  checkMachine(options, doctor);
  const std::optional<RunningRobot> running = findRobot(robot, doctor);
  doctor.tell(checkRobot(running ? withNames(robot, running->names) : robot, running));
  doctor.end();
}

}  // namespace

void addDoctorVerb(CLI::App& app) {
  const auto options = std::make_shared<DoctorOptions>();
  CLI::App* verb = addVerb(app, "doctor");
  verb->add_option("--robot", options->robot,
                   "Look for what this robot has: a name or a file, as --robot of play");
  verb->add_option("--config", options->config,
                   "A projector's configuration: its monitor has to be there, in its resolution");
  verb->add_option("--calibration", options->calibration,
                   "The folder with the lenses that the configuration names")
      ->needs("--config");
  addStoreOption(*verb, options->store);
  verb->add_flag("--json", options->json,
                 "As JSON: {ok, checks: [{name, level: ok|advice|problem, found, advice}]}");
  verb->callback([options] { runDoctor(*options); });
}

}  // namespace afterglow::nodes

// The verbs that set a robot up, `afterglow doctor` and `init`.
int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  return runCommand(argc, argv, {addDoctorVerb, addInitVerb});
}

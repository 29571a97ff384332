// `afterglow doctor` and `init`: what is made of what was found, and the bounds of looking for it.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <functional>
#include <optional>
#include <stdexcept>
#include <thread>

#include "nodes/player/robot_file.hpp"
#include "nodes/projector/projector_config.hpp"
#include "nodes/tools/diagnostics.hpp"
#include "nodes/tools/program.hpp"
#include "nodes/verbs/machine_checks.hpp"
#include "nodes/verbs/robot_checks.hpp"
#include "nodes/verbs/setup_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::doctor_checks_test {
namespace {

using Level = Checkup::Level;

/// What a Fetch looks like when all of it runs.
RunningRobot runningFetch() {
  const replay::RobotProfile fetch = findRobotProfile("fetch");
  RunningRobot running;
  running.seconds = 2;
  running.has_description = true;
  running.living = {kGuardNode};
  running.parents = {{"odom", "map"}, {"base_link", "odom"}, {"laser_link", "base_link"}};
  for (const std::string& action : fetch.controllers) {
    running.graph.subscribers[action + "/goal"] = {"/robot_driver"};
  }
  running.graph.subscribers["/cmd_vel"] = {"/cmd_vel_mux"};
  running.graph.subscribers["/robotsound"] = {"/sound_play"};
  const auto publish = [&](const std::string& topic, const std::string& type,
                           const std::string& frame) {
    running.graph.publishers[topic] = {"/robot_driver"};
    running.types[topic] = type;
    running.heard[topic].count = 20;
    running.heard[topic].frame = frame;
  };
  publish("/odom", "nav_msgs/Odometry", "odom");
  publish("/base_scan", "sensor_msgs/LaserScan", "laser_link");
  publish("/robot_state", "fetch_driver_msgs/RobotState", "");
  publish("/joint_states", "sensor_msgs/JointState", "");
  running.heard["/robot_state"].stops = false;
  for (const auto& [joint, limits] : fetch.joints) {
    running.heard["/joint_states"].joints.insert(joint);
  }
  for (const std::string& joint : fetch.gripper_joints) {
    running.heard["/joint_states"].joints.insert(joint);
  }
  return running;
}

Checkup findingOf(const std::string& name, const std::optional<RunningRobot>& running) {
  for (const Checkup& finding : checkRobot(findRobotProfile("fetch"), running)) {
    if (finding.name == name) return finding;
  }
  return {};
}

TEST(Doctor, isContentWithAFetchThatRuns) {
  for (const Checkup& finding : checkRobot(findRobotProfile("fetch"), runningFetch())) {
    EXPECT_EQ(finding.level, Level::Ok) << finding.words();
    EXPECT_EQ(finding.advice, "") << finding.words();
  }
}

TEST(Doctor, saysWhichControllerIsStopped) {
  RunningRobot running = runningFetch();
  running.controllers = {{"/arm_controller", "stopped"}, {"/head_controller", "running"}};
  const Checkup finding = findingOf("controllers", running);
  EXPECT_EQ(finding.level, Level::Advice);
  EXPECT_NE(finding.found.find("arm_controller is stopped (controller_manager)"),
            std::string::npos)
      << finding.words();
  EXPECT_EQ(finding.advice,
            "start it with `rosrun controller_manager controller_manager start arm_controller`");
}

TEST(Doctor, saysOfEachCheckThatThereIsNoMaster) {
  const auto findings = checkRobot(findRobotProfile("fetch"), std::nullopt);
  EXPECT_EQ(findings.size(), 10u);
  for (const Checkup& finding : findings) EXPECT_EQ(finding.found, "no master");
}

TEST(Doctor, checksOfARobotWithoutAProfileWhatNeedsNone) {
  EXPECT_EQ(checkRobot({}, runningFetch()).size(), 3u) << "its description, the guard, speech";
}

TEST(Doctor, saysWhatABridgeToRos2CarriesAndWhyNotTheRest) {
  RunningRobot running = runningFetch();
  EXPECT_EQ(findingOf("bridge to ROS 2", running).name, "") << "a robot of ROS 1 needs none";
  auto& bridge = running.bridges["ros2_bridge_node"];
  bridge.name = "ros2_bridge_node";
  bridge.message = "carries 3 topics to ROS 1, 1 to ROS 2";
  addValue(bridge, "on_ros2", "5");
  EXPECT_EQ(findingOf("bridge to ROS 2", running).words(),
            "ok       bridge to ROS 2: ros2_bridge_node carries 3 topics to ROS 1, 1 to ROS 2");
  bridge.level = diagnostic_msgs::DiagnosticStatus::WARN;
  bridge.message += "; refuses 1";
  addValue(bridge, "/own", "no node of ROS 2 tells its type, and ROS 1 knows none here");
  EXPECT_EQ(findingOf("bridge to ROS 2", running).words(),
            "advice   bridge to ROS 2: ros2_bridge_node carries 3 topics to ROS 1, 1 to ROS 2; "
            "refuses 1: /own: no node of ROS 2 tells its type, and ROS 1 knows none here; "
            "nodes/ros2/README.md says what is refused");
  bridge.values.clear();
  bridge.message = "meets no node of ROS 2 in domain 0, machine";
  EXPECT_EQ(
      findingOf("bridge to ROS 2", running).words(),
      "advice   bridge to ROS 2: ros2_bridge_node meets no node of ROS 2 in domain 0, machine; "
      "start the robot; ROS_DOMAIN_ID is the robot's, another machine's wants "
      "network:=subnet, and nodes need UDP beside shared memory");
}

TEST(Doctor, namesWhatIsMissingAndWhatToDo) {
  RunningRobot running = runningFetch();
  running.heard["/base_scan"].count = 0;
  EXPECT_EQ(findingOf("scan", running).words(),
            "problem  scan: nothing came on /base_scan in 2 s, from /robot_driver; start the "
            "laser: without it the base is not driven");
  running.graph.publishers.erase("/base_scan");
  EXPECT_EQ(findingOf("scan", running).found, "nobody publishes /base_scan");
  running.graph.subscribers.erase("/cmd_vel");
  EXPECT_EQ(findingOf("base", running).level, Level::Problem);
  running.graph.subscribers.erase("/gripper_controller/gripper_action/goal");
  EXPECT_EQ(findingOf("controllers", running).level, Level::Advice);
  EXPECT_EQ(findingOf("controllers", running).found,
            "5 of 6 listen; nobody listens to /gripper_controller/gripper_action");
  running.living.clear();
  EXPECT_EQ(findingOf("guard", running).level, Level::Advice);
}

TEST(Doctor, tellsAMissingLocalizationFromMissingOdometry) {
  RunningRobot running = runningFetch();
  running.parents.erase("odom");
  EXPECT_EQ(findingOf("frames", running).found,
            "no map -> odom in tf, of map -> odom -> base_link");
  EXPECT_NE(findingOf("frames", running).advice.find("amcl"), std::string::npos);
  running = runningFetch();
  running.parents.erase("base_link");
  EXPECT_EQ(findingOf("frames", running).found,
            "no odom -> base_link in tf, of map -> odom -> base_link");
  running.parents = {{"a", "b"}, {"b", "a"}, {"odom", "a"}, {"base_link", "b"}};
  EXPECT_EQ(findingOf("frames", running).level, Level::Problem) << "a circle is no tree";
}

TEST(Doctor, tellsAPressedEmergencyStopFromOneThatCannotBeRead) {
  RunningRobot running = runningFetch();
  running.heard["/robot_state"].stops = true;
  EXPECT_EQ(findingOf("emergency stop", running).level, Level::Advice);
  running.heard["/robot_state"].stops.reset();
  running.heard["/robot_state"].problem = "std_msgs/String has no field runstopped";
  EXPECT_EQ(findingOf("emergency stop", running).level, Level::Problem);
}

TEST(Doctor, noticesASpeakerBesideSoundPlay) {
  RunningRobot running = runningFetch();
  running.graph.subscribers["/robotsound"].insert("/speaker_node");
  EXPECT_EQ(findingOf("speech", running).words(),
            "advice   speech: speaker_node runs beside /sound_play, and is silent; stop one of "
            "them");
}

TEST(Doctor, callsASoftwareRendererNoGpu) {
  EXPECT_EQ(judgeRenderer("4.5 (Core Profile) Mesa 22.3.6, llvmpipe (LLVM 15)").level,
            Level::Advice);
  EXPECT_EQ(judgeRenderer("4.6.0 NVIDIA 535.1, NVIDIA RTX A2000").level, Level::Ok);
}

TEST(Doctor, wantsTheProjectorsMonitorInItsResolution) {
  const render::Monitor screen{"eDP-1", "", 0, 0, 1920, 1080};
  const render::Monitor projector{"HDMI-1", "PA600", 1920, 0, 1280, 800};
  EXPECT_EQ(judgeMonitors({screen}, {}).level, Level::Advice);
  EXPECT_EQ(judgeMonitors({screen, projector}, {}).words(),
            "ok       monitors: eDP-1 1920x1080+0+0, HDMI-1 'PA600' 1280x800+1920+0");
  EXPECT_EQ(judgeMonitors({screen, projector}, {{"", "HDMI-1", 1280, 800}}).level, Level::Ok);
  EXPECT_EQ(judgeMonitors({screen, projector}, {{"", "HDMI-1", 1920, 1200}}).level,
            Level::Problem);
  EXPECT_EQ(judgeMonitors({screen}, {{"", "HDMI-1", 1280, 800}}).level, Level::Problem);
}

TEST(Doctor, saysWhatAStoreThatIsNoneIs) {
  const test::TempFolder folder;
  EXPECT_EQ(checkStore(folder.path("new.db")).level, Level::Ok) << "the first recording makes it";
  std::ofstream(folder.path("letter.db")) << std::string(200, 'a');
  const Checkup letter = checkStore(folder.path("letter.db"));
  EXPECT_EQ(letter.level, Level::Problem);
  EXPECT_NE(letter.found.find("no SQLite database"), std::string::npos) << letter.found;
  EXPECT_EQ(checkStore("redis://a").level, Level::Problem);
}

TEST(BoundedWork, returnsWhatTheWorkReturns) {
  const std::string all = {'a', '\0', 'b'};
  EXPECT_EQ(boundedWork(10, [&] { return all; }), all);
}

TEST(BoundedWork, survivesWorkThatThrowsCrashesOrHangs) {
  const auto fault = [](double seconds, const std::function<std::string()>& work) {
    try {
      return "none: " + boundedWork(seconds, work);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
  };
  EXPECT_EQ(fault(10, []() -> std::string { throw std::runtime_error("no display"); }),
            "no display");
  EXPECT_EQ(fault(10, []() -> std::string { std::_Exit(3); }), "it ended without an answer");
  EXPECT_EQ(fault(10, []() -> std::string { ::raise(SIGKILL); return ""; }),
            "it crashes (Killed)");
  EXPECT_EQ(fault(0.1, []() -> std::string {
              while (true) ::pause();
            }),
            "no answer within 1 s");
}

/// Answers one question as the time server of a clock that is ahead by so much.
class FakeTimeServer {
 public:
  explicit FakeTimeServer(std::uint32_t ahead_s, int stratum = 2)
      : socket_(::socket(AF_INET, SOCK_DGRAM, 0)), ahead_s_(ahead_s), stratum_(stratum) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    ::bind(socket_, reinterpret_cast<sockaddr*>(&address), size);
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] {
      while (answer()) {
      }
    });
  }
  ~FakeTimeServer() {
    ::shutdown(socket_, SHUT_RDWR);
    thread_.join();
    ::close(socket_);
  }
  std::uint16_t port() const { return port_; }

 private:
  bool answer() const {
    std::array<std::uint8_t, 48> packet{};
    sockaddr_in from{};
    socklen_t size = sizeof(from);
    const auto count = ::recvfrom(socket_, packet.data(), packet.size(), 0,
                                  reinterpret_cast<sockaddr*>(&from), &size);
    if (count < static_cast<ssize_t>(packet.size())) return false;
    packet[0] = (4U << 3U) | 4U;
    packet[1] = static_cast<std::uint8_t>(stratum_);
    std::uint32_t seconds = 0;  // as it was asked, so much later
    std::memcpy(&seconds, &packet[40], 4);
    std::memcpy(&packet[24], &packet[40], 8);
    seconds = htonl(ntohl(seconds) + ahead_s_);
    std::memcpy(&packet[40], &seconds, 4);
    std::memcpy(&packet[32], &packet[40], 8);
    ::sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&from), size);
    return true;
  }

  const int socket_;
  const std::uint32_t ahead_s_;
  const int stratum_;
  std::uint16_t port_ = 0;
  std::thread thread_;
};

TEST(TimeServer, saysHowFarItsClockIsAndWithinWhat) {
  const FakeTimeServer server(100);
  const auto offset = askTimeServer("127.0.0.1", 20, server.port());
  ASSERT_TRUE(offset);
  EXPECT_LE(std::abs(offset->ahead_ns - 100'000'000'000), offset->at_most_ns + 1000);
}

TEST(TimeServer, isNotBelievedIfItsOwnClockIsNotSet) {
  const FakeTimeServer server(100, 16);
  EXPECT_FALSE(askTimeServer("127.0.0.1", 1, server.port()));
}

TEST(TimeServer, thisMachineIsKnownByItsAddresses) {
  EXPECT_TRUE(isThisMachine("127.0.0.1"));
  EXPECT_FALSE(isThisMachine("192.0.2.1")) << "an address of documentation (RFC 5737)";
}

/// With clouds, a path in a frame that nobody knows, and a marker topic that is silent.
RunningRobot showingFetch() {
  RunningRobot running = runningFetch();
  running.parents["projector_optical_frame"] = "base_link";
  const auto show = [&](const std::string& topic, const std::string& type,
                        const std::string& frame, std::size_t count) {
    running.graph.publishers[topic] = {"/perception"};
    running.types[topic] = type;
    running.heard[topic].count = count;
    running.heard[topic].frame = frame;
  };
  show("/objects", "sensor_msgs/PointCloud2", "base_link", 3);
  show("/plan", "nav_msgs/Path", "elsewhere", 1);
  show("/labels", "visualization_msgs/MarkerArray", "", 0);
  return running;
}

class SetupFiles : public testing::Test {
 protected:
  ProjectorConfig load(const std::string& text) {
    std::ofstream(folder_.path("projector.yaml")) << text;
    return loadProjectorConfig(folder_.path("projector.yaml"), folder_.path("calibration"));
  }

  test::TempFolder folder_;
  const replay::RobotProfile fetch_ = findRobotProfile("fetch");
};

TEST_F(SetupFiles, theConfigurationHasALayerForEachTopicThatCanBeShown) {
  const ProjectorConfig config = load(projectorYaml(fetch_, showingFetch()));
  EXPECT_EQ(config.fixed_frame, "map");
  ASSERT_EQ(config.layers.size(), 2u);
  EXPECT_EQ(config.layers[0].topic, "/base_scan");
  EXPECT_EQ(config.layers[1].topic, "/objects");
}

TEST_F(SetupFiles, whatCouldNotBeShownIsCommentedOutAndSaysWhy) {
  const std::string text = projectorYaml(fetch_, showingFetch());
  EXPECT_NE(text.find("  # it said nothing in 2 s:\n  # - topic: /labels\n"), std::string::npos)
      << text;
  EXPECT_NE(text.find("  # tf does not connect its frame, elsewhere, to map:\n"
                      "  # - topic: /plan\n"),
            std::string::npos)
      << text;
}

TEST_F(SetupFiles, aConfigurationLoadsThoughNothingWasFound) {
  const ProjectorConfig config = load(projectorYaml({}, {}));
  EXPECT_EQ(config.fixed_frame, "map");
  EXPECT_EQ(config.layers.size(), 1u);
}

TEST_F(SetupFiles, namesOfTheNetworkWriteNoLinesOfTheirOwn) {
  RunningRobot running = showingFetch();
  running.graph.publishers["/a\nfixed_frame: b"] = {"/perception"};
  running.types["/a\nfixed_frame: b"] = "nav_msgs/Path";
  running.heard["/plan"].frame = "b\nlayers: []";
  EXPECT_EQ(load(projectorYaml(fetch_, running)).layers.size(), 2u);
}

TEST_F(SetupFiles, theLaunchFileMovesNothingAndEscapesWhatItIsGiven) {
  replay::RobotProfile robot = fetch_;
  robot.name = "a --> b";
  const std::string text = robotLaunch(robot, showingFetch(), {"my \"robot\".yaml", "a&b.db", ""});
  EXPECT_NE(text.find("<arg name=\"allow_motion\" default=\"false\"/>"), std::string::npos) << text;
  EXPECT_NE(text.find("value=\"my &quot;robot&quot;.yaml\""), std::string::npos) << text;
  EXPECT_NE(text.find("value=\"a&amp;b.db\""), std::string::npos) << text;
  EXPECT_EQ(text.find("a --> b"), std::string::npos) << "it would end the comment";
  EXPECT_NE(text.find("value=\"[/tf, /tf_static, /joint_states, /odom]\""), std::string::npos);
}

}  // namespace
}  // namespace afterglow::nodes::doctor_checks_test

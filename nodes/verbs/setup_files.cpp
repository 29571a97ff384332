#include "nodes/verbs/setup_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "nodes/pages/page.hpp"
#include "nodes/verbs/terminal_text.hpp"

namespace afterglow::nodes {
namespace {

using replay::RobotProfile;

constexpr const char* kFloor = "floor";

/// Returns true for a name that YAML and XML take: names of the ROS graph need no quotes, others
/// are of nobody's.
bool isName(const std::string& text) {
  return !text.empty() && text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUV"
                                                 "WXYZ0123456789_/.-") == text.npos;
}

/// Content is put in a frame that stands still: the map's, else the odometry's.
struct FixedFrame {
  std::string name;
  bool is_found;
};
FixedFrame fixedFrame(const RobotProfile& robot, const RunningRobot& running) {
  const std::string map = robot.base.map_frame.empty() ? "map" : robot.base.map_frame;
  const std::string odom = robot.base.odom_frame.empty() ? "odom" : robot.base.odom_frame;
  for (const std::string& frame : {map, odom}) {
    if (isName(frame) && running.hasFrame(frame)) return {frame, true};
  }
  return {isName(map) ? map : "map", false};
}

struct Layer {
  std::string topic, type;
  std::string absence;  ///< the reason why it is commented out; empty: it is not
};

std::vector<Layer> layersOf(const RunningRobot& running, const FixedFrame& fixed) {
  std::vector<Layer> layers;
  for (const std::string& topic : projectableTopics(running.graph, running.types)) {
    Layer layer{topic, running.types.at(topic), {}};
    const auto heard = running.heard.find(topic);
    if (heard == running.heard.end()) {
      layer.absence = "there were too many topics to listen to it";
    } else if (heard->second.count == 0) {
      layer.absence = fmt::format("it said nothing in {:g} s", running.seconds);
    } else if (!heard->second.problem.empty()) {
      layer.absence = oneLine(heard->second.problem);
    } else if (heard->second.frame.empty()) {
      layer.absence = "it names no frame";
    } else if (heard->second.frame != fixed.name &&
               !running.areConnected(heard->second.frame, fixed.name)) {
      layer.absence = "tf does not connect its frame, " + oneLine(heard->second.frame) + ", to " +
                      fixed.name;
    }
    layers.push_back(std::move(layer));
  }
  return layers;
}

/// Returns its looks, as assets/projector.yaml has them.
std::string looks(const std::string& type) {
  const std::string on_floor = fmt::format("\n    placement: drape\n    surface: {}", kFloor);
  if (type == "sensor_msgs/PointCloud2") return "\n    style: boxes\n    size: 0.005";
  if (type == "sensor_msgs/LaserScan") {
    return "\n    style: spheres\n    size: 0.05\n    color: [206, 92, 0]" + on_floor;
  }
  if (type == "nav_msgs/Path") return "\n    size: 0.03\n    color: \"#00ff00\"" + on_floor;
  return "";  // markers bring theirs
}

std::string commentedOut(const std::string& text) {
  std::string commented = "  # ";
  for (std::size_t i = 2; i < text.size(); ++i) {
    commented += text[i];
    if (text[i] == '\n') commented += "  # ", i += 2;
  }
  return commented;
}

std::string layerText(const Layer& layer) {
  const std::string text = fmt::format("  - topic: {}\n    type: {}{}", layer.topic, layer.type,
                                       looks(layer.type));
  if (layer.absence.empty()) return text + "\n";
  return fmt::format("  # {}:\n{}\n", layer.absence, commentedOut(text));
}

/// Returns the head of each file, as lines.
std::vector<std::string> headOf(const RobotProfile& robot, const RunningRobot& running) {
  const std::string name = robot.name.empty() ? "a robot without a profile" : oneLine(robot.name);
  std::vector<std::string> lines = {"Written by `afterglow init` for " + name +
                                    ", from what ran then. To be checked:"};
  for (const std::string& thing : thingsToCheck(robot, running)) {
    lines.push_back("- " + oneLine(thing));
  }
  return lines;
}

/// Two dashes end a comment of XML.
std::string xmlComment(const std::vector<std::string>& lines) {
  std::string text = fmt::format("{}", fmt::join(lines, "\n       "));
  for (std::size_t at; (at = text.find("--")) != text.npos;) text.replace(at, 2, "- ");
  return "  <!-- " + text + "\n  -->\n";
}

std::vector<std::string> contextTopics(const RobotProfile& robot, const RunningRobot& running) {
  std::vector<std::string> topics = {"/tf", "/tf_static"};
  for (const char* type : {"sensor_msgs/JointState", "nav_msgs/Odometry"}) {
    for (const std::string& topic : running.publishedTopics(type)) {
      const bool is_judges = topic.find("/fake_fetch/") != topic.npos;
      const bool is_other_odometry = type == std::string("nav_msgs/Odometry") &&
                                     !robot.base.odometry_topic.empty() &&
                                     topic != robot.base.odometry_topic;
      if (isName(topic) && !is_judges && !is_other_odometry) topics.push_back(topic);
    }
  }
  return topics;
}

std::vector<std::string> anchors(const RobotProfile& robot, const RunningRobot& running) {
  std::vector<std::string> frames;
  for (const std::string& frame : {robot.base.map_frame, robot.base.odom_frame,
                                   robot.base.base_frame,
                                   running.names.frame("projector_optical_frame")}) {
    if (isName(frame) && running.hasFrame(frame)) frames.push_back(frame);
  }
  return frames;
}

std::string argument(const std::string& name, const std::string& value) {
  return fmt::format("    <arg name=\"{}\" value=\"{}\"/>\n", name, value);
}
std::string missingArgument(const std::string& name, const std::string& why) {
  return fmt::format("    <!-- {}: {} -->\n", name, why);
}

std::string include(const std::string& name, const std::string& arguments) {
  return fmt::format("  <include file=\"$(find afterglow)/nodes/launch/{}.launch\">\n{}"
                     "  </include>\n",
                     name, arguments);
}

std::string recorderArguments(const RobotProfile& robot, const RunningRobot& running) {
  std::string text = argument(
      "context_topics", fmt::format("[{}]", fmt::join(contextTopics(robot, running), ", ")));
  const std::vector<std::string> frames = anchors(robot, running);
  text += frames.size() < 2
              ? missingArgument("anchors", "no frames were found, so the usual ones")
              : argument("anchors", fmt::format("[{}]", fmt::join(frames, ", ")));
  const auto maps = running.publishedTopics("nav_msgs/OccupancyGrid");
  const bool has_map = std::count(maps.begin(), maps.end(), "/map") > 0;
  return text + (has_map ? argument("map_topic", "/map")
                         : missingArgument("map_topic", "nobody published /map"));
}

std::string playerRemarks(const RobotProfile& robot) {
  std::string text;
  if (robot.scan_topic.empty()) {
    text += missingArgument("scan", "no profile names one; the base is not driven without");
  }
  if (robot.emergency_stop.topic.empty()) {
    text += missingArgument("estop_topic", "no profile names one: TOPIC:FIELD");
  }
  return text;
}

}  // namespace

const std::vector<std::string>& projectableTypes() {
  static const std::vector<std::string> types = {
      "sensor_msgs/PointCloud2", "sensor_msgs/LaserScan", "nav_msgs/Path",
      "visualization_msgs/Marker", "visualization_msgs/MarkerArray"};
  return types;
}

std::vector<std::string> projectableTopics(const RosGraph& graph,
                                           const std::map<std::string, std::string>& types) {
  static const std::set<std::string> own = {"/projector_node", "/calibrator_node", "/player_node"};
  std::vector<std::string> topics;
  for (const auto& [topic, type] : types) {
    const auto& known = projectableTypes();
    const auto publishers = graph.otherPublishers(topic);
    const bool is_others =
        std::any_of(publishers.begin(), publishers.end(),
                    [](const std::string& node) { return own.count(node) == 0; });
    if (isName(topic) && is_others && std::count(known.begin(), known.end(), type) > 0) {
      topics.push_back(topic);
    }
  }
  return topics;
}

std::vector<std::string> thingsToCheck(const RobotProfile& robot, const RunningRobot& running) {
  const FixedFrame fixed = fixedFrame(robot, running);
  std::vector<std::string> things;
  if (!fixed.is_found) {
    things.push_back("tf had neither map nor odom: start localization, and look at fixed_frame");
  } else if (!robot.base.map_frame.empty() && fixed.name != robot.base.map_frame) {
    things.push_back("tf had no " + robot.base.map_frame + ": " + fixed.name +
                     " drifts; start localization and run init again");
  }
  if (!running.hasFrame("projector_optical_frame")) {
    things.push_back("tf had no projector_optical_frame: afterglow calibrate mount");
  }
  things.push_back("the surface floor is a guess: z = 0, 10 m around the origin");
  things.push_back("which layers people should see, how large, on which surface");
  if (robot.name.empty()) {
    things.push_back("no profile was named: the player knows no scan and no emergency stop");
  }
  things.push_back("allow_motion is false; before it is true read nodes/first_hour.md");
  return things;
}

std::string projectorYaml(const RobotProfile& robot, const RunningRobot& running) {
  const FixedFrame fixed = fixedFrame(robot, running);
  std::string text = fmt::format("# {}\n", fmt::join(headOf(robot, running), "\n#   "));
  text += "# Every key: assets/projector.yaml.\n";
  text += fmt::format("fixed_frame: {}{}\n\n", fixed.name, fixed.is_found ? "" : "  # not found");
  text += fmt::format("projector:\n  camera_info: projector.yaml  # of the calibration's folder\n"
                      "  frame: projector_optical_frame{}\n\n",
                      running.hasFrame("projector_optical_frame") ? "" : "  # not found");
  text += fmt::format("surfaces:\n  {}: {{frame: {}, polygon: [[-10, -10], [10, -10], [10, 10], "
                      "[-10, 10]]}}\n\n",
                      kFloor, fixed.name);
  const std::vector<Layer> layers = layersOf(running, fixed);
  const bool has_any = std::any_of(layers.begin(), layers.end(),
                                   [](const Layer& layer) { return layer.absence.empty(); });
  text += "layers:\n";
  if (!has_any) {  // at least one is needed
    text += "  # Nothing was heard that a projector can show. Of any node:\n";
    text += layerText({"/visualization_marker_array", "visualization_msgs/MarkerArray", {}});
  }
  for (const Layer& layer : layers) text += layerText(layer);
  return text;
}

std::string robotLaunch(const RobotProfile& robot, const RunningRobot& running,
                        const SetupWords& words) {
  std::string text = "<?xml version=\"1.0\"?>\n<launch>\n";
  text += xmlComment(headOf(robot, running));
  text += "  <arg name=\"allow_motion\" default=\"false\"/>\n";
  const std::string calibration =
      words.calibration.empty() ? "$(dirname)/calibration" : escaped(oneLine(words.calibration));
  text += include("projector", argument("config", "$(dirname)/projector.yaml") +
                                   argument("calibration", calibration));
  text += include("recorder", argument("store", escaped(oneLine(words.store))) +
                                  argument("robot", escaped(oneLine(robot.name))) +
                                  recorderArguments(robot, running));
  text +=
      include("player", argument("store", escaped(oneLine(words.store))) +
                            argument("robot", escaped(oneLine(words.robot))) +
                            argument("allow_motion", "$(arg allow_motion)") + playerRemarks(robot));
  text += include("speaker", "");
  text += "  <!-- On the robot itself: roslaunch afterglow guard.launch -->\n</launch>\n";
  return text;
}

}  // namespace afterglow::nodes

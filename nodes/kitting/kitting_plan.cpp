#include "nodes/kitting/kitting_plan.hpp"

#include <cmath>
#include <stdexcept>

#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kRoom = 100;   // m: nothing of the demo is further away
constexpr double kMinute = 60;  // s: no motion takes longer
constexpr double kSmallest = 1e-3;

double radians(double degrees) { return degrees * M_PI / 180; }

/// One YAML file's readers of what a scenario is made of.
class Reader {
 public:
  explicit Reader(std::string path) : file_(std::move(path)) {}

  KittingPlan plan() const;
  std::vector<Thing> things() const;

 private:
  YamlMap map(const YAML::Node& node, const std::string& where,
              const std::vector<std::string>& keys) const {
    return {file_, node, where, keys};
  }
  Eigen::Vector3d vector3(const YamlMap& map, const std::string& key) const;
  Eigen::Vector2d vector2(const YamlMap& map, const std::string& key) const;
  double angle(const YamlMap& map, const std::string& key) const {
    return radians(map.number(key, -360, 360));
  }
  double length(const YamlMap& map, const std::string& key) const {
    return map.number(key, 0, kRoom);
  }
  double positive(const YamlMap& map, const std::string& key) const {
    return map.number(key, kSmallest, kRoom);
  }
  std::vector<std::string> texts(const YamlMap& map, const std::string& key) const;
  std::vector<Eigen::Vector2d> outline(const YamlMap& map, const std::string& key) const;
  Durations durations(const YamlMap& map, const std::vector<std::string>& names) const;
  Eigen::Isometry3d pose(const YamlMap& map) const;
  Paint paint(const YamlMap& map) const;
  Part part(const YAML::Node& node, const std::string& where) const;
  Thing thing(const YAML::Node& node) const;
  PickPlan pick(const YAML::Node& node) const;
  DrivePlan drive(const YAML::Node& node) const;
  PathMarkerStyle arrows(const YAML::Node& node) const;
  PlacePlan place(const YAML::Node& node) const;

  std::string file_;
};

Eigen::Vector3d Reader::vector3(const YamlMap& map, const std::string& key) const {
  const std::vector<double> v = map.numbers(map.at(key), "'" + key + "' of " + map.where(), 3);
  return {v[0], v[1], v[2]};
}

Eigen::Vector2d Reader::vector2(const YamlMap& map, const std::string& key) const {
  const std::vector<double> v = map.numbers(map.at(key), "'" + key + "' of " + map.where(), 2);
  return {v[0], v[1]};
}

std::vector<std::string> Reader::texts(const YamlMap& map, const std::string& key) const {
  const YAML::Node list = map.at(key);
  std::vector<std::string> result;
  if (!YAML::convert<std::vector<std::string>>::decode(list, result)) {
    map.fail(list, "'" + key + "' of " + map.where() + " should be a list of texts");
  }
  return result;
}

std::vector<Eigen::Vector2d> Reader::outline(const YamlMap& map, const std::string& key) const {
  const YAML::Node list = map.at(key);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; list.IsSequence() && i < list.size(); ++i) {
    const std::vector<double> p = map.numbers(list[i], "a corner of " + map.where(), 2);
    points.emplace_back(p[0], p[1]);
  }
  if (points.size() < 3) map.fail(list, "'" + key + "' should be a list of three corners or more");
  return points;
}

Durations Reader::durations(const YamlMap& parent, const std::vector<std::string>& names) const {
  const YamlMap seconds = map(parent.at("seconds"), "'seconds' of " + parent.where(), names);
  Durations result;
  for (const std::string& name : names) result[name] = seconds.number(name, 0.05, kMinute);
  return result;
}

Eigen::Isometry3d Reader::pose(const YamlMap& map) const {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = vector3(map, "at");
  const double yaw = radians(map.number("yaw", -360, 360, 0));
  T.rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  return T;
}

Paint Reader::paint(const YamlMap& map) const {
  const std::string text = map.text("color");
  const bool hex = text.size() == 7 && text[0] == '#' &&
                   text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
  if (!hex) map.fail(map.at("color"), "a color looks like \"#a0b1c2\", not '" + text + "'");
  const unsigned long value = std::stoul(text.substr(1), nullptr, 16);
  const auto component = [&](int shift) { return float((value >> shift) & 0xff) / 255; };
  return {component(16), component(8), component(0)};
}

Part Reader::part(const YAML::Node& node, const std::string& where) const {
  const YamlMap values =
      map(node, where, {"box", "cylinder", "prism", "height", "at", "yaw", "color"});
  Part part;
  if (values.has("box")) {
    part.size = vector3(values, "box");
  } else if (values.has("cylinder")) {
    part.shape = Part::Shape::Cylinder;
    part.size = vector3(values, "cylinder");
  } else if (values.has("prism")) {
    part.shape = Part::Shape::Prism;
    part.outline = outline(values, "prism");
    part.size.z() = positive(values, "height");
  } else {
    values.fail(node, where + " should be a box, a cylinder or a prism");
  }
  if (part.size.minCoeff() <= 0) values.fail(node, "the sizes of " + where + " should be positive");
  part.T_thing_part = pose(values);
  part.paint = paint(values);
  return part;
}

Thing Reader::thing(const YAML::Node& node) const {
  const YamlMap values =
      map(node, "a thing", {"name", "furniture", "low", "surface", "at", "yaw", "parts"});
  Thing thing;
  thing.name = values.text("name");
  const auto flag = [&](const std::string& key) {
    return values.has(key) && values.choice(key, {"false", "true"}) == 1;
  };
  thing.furniture = flag("furniture");
  thing.low = flag("low");
  if (values.has("surface")) thing.surface = length(values, "surface");
  thing.T_map_thing = pose(values);
  const YAML::Node parts = values.at("parts");
  if (!parts.IsSequence()) values.fail(parts, "'parts' of " + thing.name + " should be a list");
  for (const YAML::Node& each : parts) thing.parts.push_back(part(each, "a part of " + thing.name));
  return thing;
}

std::vector<Thing> Reader::things() const {
  const YamlMap values = map(loadYaml(file_), "the room", {"things"});
  const YAML::Node list = values.at("things");
  if (!list.IsSequence()) values.fail(list, "'things' should be a list");
  std::vector<Thing> result;
  for (const YAML::Node& node : list) result.push_back(thing(node));
  return result;
}

PickPlan Reader::pick(const YAML::Node& node) const {
  const YamlMap values = map(node, "'pick'",
                             {"recognized", "grasped", "point_spacing", "torso", "grasp_yaw",
                              "grasp_height", "approach", "lift", "gap", "says", "seconds"});
  PickPlan plan;
  plan.recognized = texts(values, "recognized");
  plan.grasped = values.text("grasped");
  plan.point_spacing = positive(values, "point_spacing");
  plan.torso = length(values, "torso");
  plan.grasp_yaw = angle(values, "grasp_yaw");
  plan.grasp_height = length(values, "grasp_height");
  plan.approach = length(values, "approach");
  plan.lift = length(values, "lift");
  plan.gap = length(values, "gap");
  plan.says = values.text("says");
  plan.seconds = durations(values, {"look", "reach", "descend", "close", "lift", "retreat"});
  return plan;
}

PathMarkerStyle Reader::arrows(const YAML::Node& node) const {
  const YamlMap values = map(node, "'arrows'", {"spacing", "shaft", "head", "goal"});
  PathMarkerStyle style;
  style.spacing = values.number("spacing", 0.01, kRoom);
  style.shaft = positive(values, "shaft");
  style.head = positive(values, "head");
  style.goal = positive(values, "goal");
  return style;
}

DrivePlan Reader::drive(const YAML::Node& node) const {
  const YamlMap values = map(
      node, "'drive'",
      {"goal", "goal_yaw", "clearance", "speed", "acceleration", "turn_speed", "turn_acceleration",
       "look_ahead", "command_hz", "scan_hz", "path_seconds", "aim_seconds", "aim_ahead",
       "aim_widest", "head_tilt", "perceive", "says", "says_after", "arrows"});
  DrivePlan plan;
  const Eigen::Vector2d goal = vector2(values, "goal");
  plan.goal = {goal.x(), goal.y(), angle(values, "goal_yaw")};
  plan.clearance = length(values, "clearance");
  plan.limits.speed = positive(values, "speed");
  plan.limits.acceleration = positive(values, "acceleration");
  plan.limits.turn_speed = positive(values, "turn_speed");
  plan.limits.turn_acceleration = positive(values, "turn_acceleration");
  plan.limits.look_ahead = positive(values, "look_ahead");
  plan.command_hz = values.number("command_hz", 1, 200);
  plan.scan_hz = values.number("scan_hz", 0.1, 200);
  plan.path_seconds = values.number("path_seconds", 0.05, kMinute);
  plan.aim_seconds = values.number("aim_seconds", 0.05, kMinute);
  plan.aim_ahead = length(values, "aim_ahead");
  plan.aim_widest = angle(values, "aim_widest");
  plan.head_tilt = angle(values, "head_tilt");
  plan.perceive = values.number("perceive", 0, kMinute);
  plan.says = values.text("says");
  plan.says_after = values.number("says_after", 0, kMinute);
  plan.arrows = arrows(values.at("arrows"));
  return plan;
}

PlacePlan Reader::place(const YAML::Node& node) const {
  const YamlMap values = map(node, "'place'",
                             {"caddy", "section", "cube", "torso", "grasp_yaw", "approach",
                              "release", "floor", "says", "seconds"});
  PlacePlan plan;
  plan.caddy = values.text("caddy");
  plan.section = vector2(values, "section");
  plan.cube = vector3(values, "cube");
  plan.torso = length(values, "torso");
  plan.grasp_yaw = angle(values, "grasp_yaw");
  plan.approach = length(values, "approach");
  plan.release = length(values, "release");
  plan.floor = length(values, "floor");
  plan.says = values.text("says");
  plan.seconds =
      durations(values, {"lift_torso", "look", "reach", "lower", "open", "raise", "retreat"});
  return plan;
}

KittingPlan Reader::plan() const {
  const YamlMap values = map(loadYaml(file_), "the task",
                             {"voice", "speech_seconds", "gripper_open", "settle", "carry",
                              "carry_torso", "pick", "drive", "place"});
  KittingPlan plan;
  plan.voice = values.text("voice");
  plan.speech_seconds = values.number("speech_seconds", 0, kMinute);
  plan.gripper_open = length(values, "gripper_open");
  plan.settle = values.number("settle", 0, kMinute);
  plan.carry = vector3(values, "carry");
  plan.carry_torso = length(values, "carry_torso");
  plan.pick = pick(values.at("pick"));
  plan.drive = drive(values.at("drive"));
  plan.place = place(values.at("place"));
  return plan;
}

}  // namespace

KittingPlan loadKittingPlan(const std::string& path) { return Reader(path).plan(); }

World loadRoom(const std::string& path) {
  try {
    return World(Reader(path).things());
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

const std::vector<std::string>& kittingTopics() {
  static const std::vector<std::string> topics = {
      "/gripper_controller/gripper_action/goal",
      "/arm_with_torso_controller/follow_joint_trajectory/goal",
      "/torso_controller/follow_joint_trajectory/goal",
      "/head_controller/point_head/goal",
      "/head_controller/follow_joint_trajectory/goal",
      "/cmd_vel",
      "/projector/follow_joint_trajectory/goal",
      "/projector/white_points",
      "/projector/green_points",
      "/gearbox_compartment_marker",
      "/projector/nav/path",
      "/base_scan_obstacles_only",
      "/robotsound",
  };
  return topics;
}

}  // namespace afterglow::nodes

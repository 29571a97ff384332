#include "nodes/player/robot_file.hpp"

#include <filesystem>
#include <stdexcept>
#include <vector>

namespace afterglow::nodes {
namespace {

using replay::RobotProfile;

constexpr double kMost = 1000;  // of what is measured here

/// The value, or none.
std::string textIn(const YamlMap& map, const std::string& key) {
  return map.has(key) ? map.text(key) : std::string();
}

double numberIn(const YamlMap& map, const std::string& key) { return map.number(key, 0, kMost, 0); }

/// A list of names; none if the key is missing.
std::vector<std::string> textsIn(const YamlMap& map, const std::string& key) {
  std::vector<std::string> texts;
  if (!map.has(key)) return texts;
  const YAML::Node list = map.at(key);
  if (!list.IsSequence()) map.fail(list, "'" + key + "' of " + map.where() + " should be a list");
  for (const auto& entry : list) {
    if (!entry.IsScalar() || entry.Scalar().empty()) {
      map.fail(entry, "each of '" + key + "' of " + map.where() + " should be a text");
    }
    texts.push_back(entry.Scalar());
  }
  return texts;
}

void checkTopic(const YamlMap& map, const std::string& key, const std::string& topic) {
  try {
    if (!topic.empty()) replay::TopicName{topic};
  } catch (const std::invalid_argument& error) {
    map.fail(map.at(key), error.what());
  }
}

std::string topicIn(const YamlMap& map, const std::string& key) {
  const std::string topic = textIn(map, key);
  checkTopic(map, key, topic);
  return topic;
}

std::vector<std::string> topicsIn(const YamlMap& map, const std::string& key) {
  const std::vector<std::string> topics = textsIn(map, key);
  for (const std::string& topic : topics) checkTopic(map, key, topic);
  return topics;
}

bool isTrueIn(const YamlMap& map, const char* key, bool otherwise) {
  return map.has(key) ? map.choice(key, {"false", "true"}) == 1 : otherwise;
}

void readTopics(const YamlMap& map, RobotProfile& robot) {
  if (!map.has("topics")) return;
  std::vector<std::string> words;
  for (const auto& [word, topic_class] : replay::topicClassWords()) words.push_back(word);
  const YamlMap topics = map.map(map.at("topics"), "topics", words);
  for (const auto& [word, topic_class] : replay::topicClassWords()) {
    robot.topics[topic_class] = textsIn(topics, word);
  }
}

void readFootprint(const YamlMap& map, RobotProfile::Base& base) {
  if (!map.has("footprint")) return;
  const YAML::Node corners = map.at("footprint");
  if (!corners.IsSequence() || corners.size() < 3) {
    map.fail(corners, "'footprint' should be a list of at least 3 corners, [x, y] in m");
  }
  for (const auto& corner : corners) {
    const std::vector<double> xy = map.numbers(corner, "a corner of 'footprint'", 2);
    base.footprint.push_back({xy[0], xy[1]});
  }
}

void readBase(const YamlMap& map, RobotProfile::Base& base) {
  base.velocity_topic = topicIn(map, "velocity_topic");
  base.take_over_topics = topicsIn(map, "take_over_topics");
  base.output_topic = topicIn(map, "output_topic");
  base.odometry_topic = topicIn(map, "odometry_topic");
  if (map.has("frames")) {
    const YamlMap frames = map.map(map.at("frames"), "frames", {"map", "odom", "base"});
    base.map_frame = textIn(frames, "map");
    base.odom_frame = textIn(frames, "odom");
    base.base_frame = textIn(frames, "base");
  }
  readFootprint(map, base);
  base.deceleration = numberIn(map, "deceleration");
  base.command_timeout_s = numberIn(map, "command_timeout");
  base.fastest = numberIn(map, "fastest");
  base.fastest_turn = numberIn(map, "fastest_turn");
  base.linear_acceleration = numberIn(map, "linear_acceleration");
  base.angular_acceleration = numberIn(map, "angular_acceleration");
  base.is_holonomic = isTrueIn(map, "holonomic", false);
}

void readEmergencyStop(const YamlMap& map, RobotProfile::EmergencyStop& stop) {
  stop.topic = topicIn(map, "topic");
  stop.field = textIn(map, "field");
  stop.stops_when = isTrueIn(map, "stops_when", true);
}

RobotProfile profileOf(const std::string& path, const YAML::Node& root) {
  const YamlMap map(path, root, "the robot",
                    {"name", "topics", "controllers", "controllers_join", "base", "scan_topic",
                     "emergency_stop", "joints", "gripper_joints", "gaze_frame"});
  RobotProfile robot;
  robot.name = map.text("name");
  readTopics(map, robot);
  if (map.has("base")) {
    readBase(map.map(map.at("base"), "base",
                     {"velocity_topic", "take_over_topics", "output_topic", "odometry_topic",
                      "frames", "footprint", "deceleration", "command_timeout", "fastest",
                      "fastest_turn", "linear_acceleration", "angular_acceleration", "holonomic"}),
             robot.base);
  }
  robot.controllers = topicsIn(map, "controllers");
  robot.controllers_join = isTrueIn(map, "controllers_join", false);
  robot.scan_topic = topicIn(map, "scan_topic");
  if (map.has("emergency_stop")) {
    readEmergencyStop(map.map(map.at("emergency_stop"), "emergency_stop",
                              {"topic", "field", "stops_when"}),
                      robot.emergency_stop);
  }
  if (map.has("joints")) robot.joints = jointLimitsIn(map, "speed", {"acceleration", "range"});
  robot.gripper_joints = textsIn(map, "gripper_joints");
  robot.gaze_frame = textIn(map, "gaze_frame");
  return robot;
}

}  // namespace

replay::JointLimits jointLimits(const YamlMap& map, const std::string& velocity) {
  replay::JointLimits joint;
  if (map.has(velocity)) joint.velocity = map.number(velocity, 0, kMost);
  if (map.has("acceleration")) joint.acceleration = map.number("acceleration", 0, kMost);
  if (map.has("range")) {
    const YAML::Node range = map.at("range");
    const std::vector<double> ends = map.numbers(range, "'range' of " + map.where(), 2);
    if (ends[0] >= ends[1]) map.fail(range, "'range' of " + map.where() + " should rise");
    joint.range = {ends[0], ends[1]};
  }
  return joint;
}

std::map<std::string, replay::JointLimits> jointLimitsIn(const YamlMap& map,
                                                         const std::string& velocity,
                                                         std::vector<std::string> other_keys) {
  std::map<std::string, replay::JointLimits> limits;
  other_keys.insert(other_keys.begin(), velocity);
  const YAML::Node joints = map.at("joints");
  if (!joints.IsMap()) map.fail(joints, "'joints' should be a map of joints");
  for (const auto& joint : joints) {
    const auto name = joint.first.as<std::string>();
    limits[name] = jointLimits(map.map(joint.second, "joint " + name, other_keys), velocity);
  }
  return limits;
}

RobotProfile readRobotProfile(const std::string& path) { return profileOf(path, loadYaml(path)); }

std::optional<RobotProfile> builtInRobot(const std::string& name) {
  for (const EmbeddedRobot* robot = kEmbeddedRobots; robot->name; ++robot) {
    if (name + ".yaml" != robot->name) continue;
    return profileOf("assets/robots/" + std::string(robot->name), YAML::Load(robot->text));
  }
  return std::nullopt;
}

RobotProfile findRobotProfile(const std::string& name_or_file) {
  const bool is_file = name_or_file.find('/') != std::string::npos ||
                       std::filesystem::path(name_or_file).extension() == ".yaml";
  if (is_file) return readRobotProfile(name_or_file);
  if (const auto robot = builtInRobot(name_or_file)) return *robot;
  std::vector<std::string> names;
  for (const EmbeddedRobot* robot = kEmbeddedRobots; robot->name; ++robot) {
    names.push_back(std::filesystem::path(robot->name).stem());
  }
  throw std::runtime_error("no robot '" + name_or_file + "' is known" +
                           advice(name_or_file, names) + " (a file has a slash or ends in .yaml)");
}

RobotProfile withNames(RobotProfile robot, const replay::RobotNames& names) {
  RobotProfile::Base& base = robot.base;
  for (std::string* topic : {&base.velocity_topic, &base.output_topic, &base.odometry_topic,
                             &robot.scan_topic, &robot.emergency_stop.topic}) {
    *topic = names.topic(*topic);
  }
  for (std::string& topic : base.take_over_topics) topic = names.topic(topic);
  for (std::string& topic : robot.controllers) topic = names.topic(topic);
  for (std::string* frame :
       {&base.map_frame, &base.odom_frame, &base.base_frame, &robot.gaze_frame}) {
    *frame = names.frame(*frame);
  }
  return robot;
}

namespace {

constexpr double kFastestLimit = 1000;

replay::TopicName topicName(const calib::YamlSource& source, const YAML::Node& node) {
  try {
    return node.IsScalar() ? node.Scalar() : "";
  } catch (const std::invalid_argument& error) {
    source.refuse(node, error.what());
  }
}

std::vector<replay::TopicName> topicNames(const calib::YamlSource& source,
                                          const YAML::Node& list) {
  std::vector<replay::TopicName> names;
  if (!list.IsSequence()) source.refuse(list, "'also' should be a list of topics");
  for (const auto& entry : list) names.push_back(topicName(source, entry));
  return names;
}

/// zero, empty, {cancel: /TOPIC} or {FIELD: NUMBER, ...}.
replay::MotionStop stopOf(const calib::YamlSource& source, const YAML::Node& node) {
  using replay::StopKind;
  replay::MotionStop stop;
  stop.rule = source.path() + ":" + std::to_string(node.Mark().line + 1);
  if (node.IsScalar() && (node.Scalar() == "zero" || node.Scalar() == "empty")) {
    stop.kind = node.Scalar() == "zero" ? StopKind::Zero : StopKind::NoPoints;
    return stop;
  }
  if (!node.IsMap() || node.size() == 0) {
    source.refuse(node, "a stop should be zero, empty, {cancel: /TOPIC} or {FIELD: NUMBER}");
  }
  if (node.size() == 1 && node["cancel"]) {
    stop.kind = StopKind::Cancel;
    stop.cancel_topic = topicName(source, node["cancel"]).text();
    return stop;
  }
  stop.kind = StopKind::Fields;
  for (const auto& field : node) {
    const auto path = field.first.as<std::string>();
    const std::string word = field.second.IsScalar() ? field.second.Scalar() : "";
    const bool is_flag = word == "true" || word == "false";
    stop.fields[path] =
        is_flag ? (word == "true" ? 1 : 0) : source.number(field.second, "field " + path);
  }
  return stop;
}

std::map<replay::TopicName, replay::MotionStop> stopsOf(const calib::YamlSource& source,
                                                        const YAML::Node& map) {
  std::map<replay::TopicName, replay::MotionStop> stops;
  if (!map.IsMap()) source.refuse(map, "'stops' should be a map of topics");
  for (const auto& topic : map) {
    stops[topicName(source, topic.first)] = stopOf(source, topic.second);
  }
  return stops;
}

}  // namespace

std::map<std::string, std::string> parseRenames(const std::vector<std::string>& texts) {
  std::map<std::string, std::string> renames;
  for (const std::string& text : texts) {
    const std::size_t sign = text.find(":=");
    if (sign == std::string::npos || sign == 0 || sign + 2 == text.size()) {
      throw std::invalid_argument("'" + text + "' is no renaming: write old:=new");
    }
    renames[text.substr(0, sign)] = text.substr(sign + 2);
  }
  return renames;
}

std::map<replay::TopicName, replay::TopicName> parseTopicRenames(
    const std::vector<std::string>& texts) {
  std::map<replay::TopicName, replay::TopicName> renames;
  for (const auto& [from, to] : parseRenames(texts)) renames.emplace(from, to);
  return renames;
}

ReplayRules readRules(const std::string& path) {
  ReplayRules rules;
  const calib::YamlSource source(path);
  const YAML::Node& types = source.root();
  if (!types.IsMap()) source.refuse(types, "rules should be a map of message types");
  for (const auto& type : types) {
    const auto name = type.first.as<std::string>();
    if (name == "also") {
      rules.also = topicNames(source, type.second);
      continue;
    }
    if (name == "stops") {
      rules.stops = stopsOf(source, type.second);
      continue;
    }
    if (name.find('/') == std::string::npos || !type.second.IsMap()) {
      source.refuse(type.first, "'" + name + "' should be a type, package/Type, with its fields");
    }
    for (const auto& field : type.second) {
      const std::string word = field.second.IsScalar() ? field.second.Scalar() : "";
      const auto rule = replay::parseRule(word);
      if (!rule) {
        source.refuse(
            field.second,
            "'" + word + "' is no rule" +
                advice(word, {"shift", "now", "zero", "keep", "fresh_id", "remap_frame"}));
      }
      rules.types[name][field.first.as<std::string>()] = *rule;
    }
  }
  return rules;
}

replay::MotionLimits readLimits(const std::string& path) {
  const YamlMap map(path, loadYaml(path), "limits",
                    {"linear_velocity", "angular_velocity", "joints", "other_joints"});
  replay::MotionLimits limits;
  limits.are_given = true;
  if (map.has("linear_velocity")) limits.linear = map.number("linear_velocity", 0, kFastestLimit);
  if (map.has("angular_velocity")) {
    limits.angular = map.number("angular_velocity", 0, kFastestLimit);
  }
  if (map.has("joints")) limits.joints = jointLimitsIn(map, "velocity", {"acceleration"});
  if (map.has("other_joints")) {
    const YamlMap others =
        map.map(map.at("other_joints"), "other_joints", {"velocity", "acceleration"});
    limits.other_joints = jointLimits(others, "velocity");
  }
  return limits;
}

}  // namespace afterglow::nodes

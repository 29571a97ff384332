#include "nodes/player/replay_words.hpp"

#include <stdexcept>

#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kFastestLimit = 1000;

replay::MotionLimits::Joint jointLimits(const YamlMap& map) {
  replay::MotionLimits::Joint joint;
  if (map.has("velocity")) joint.velocity = map.number("velocity", 0, kFastestLimit);
  if (map.has("acceleration")) joint.acceleration = map.number("acceleration", 0, kFastestLimit);
  return joint;
}

std::vector<std::string> topicNames(const calib::YamlSource& source,
                                    const YAML::Node& list) {
  std::vector<std::string> names;
  if (!list.IsSequence()) source.refuse(list, "'also' should be a list of topics");
  for (const auto& entry : list) {
    const std::string name = entry.IsScalar() ? entry.Scalar() : "";
    if (name.size() < 2 || name[0] != '/') {
      source.refuse(entry, "'" + name + "' should be a topic, /NAME");
    }
    names.push_back(name);
  }
  return names;
}

}  // namespace

std::map<std::string, std::string> parseRenames(const std::vector<std::string>& texts) {
  std::map<std::string, std::string> renames;
  for (const std::string& text : texts) {
    const std::size_t sign = text.find(":=");
    if (sign == std::string::npos || sign == 0 || sign + 2 == text.size()) {
      throw std::runtime_error("'" + text + "' is no renaming: write old:=new");
    }
    renames[text.substr(0, sign)] = text.substr(sign + 2);
  }
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
  limits.is_strict = true;
  if (map.has("linear_velocity")) limits.linear = map.number("linear_velocity", 0, kFastestLimit);
  if (map.has("angular_velocity")) {
    limits.angular = map.number("angular_velocity", 0, kFastestLimit);
  }
  const std::vector<std::string> keys{"velocity", "acceleration"};
  if (map.has("joints")) {
    const YAML::Node joints = map.at("joints");
    if (!joints.IsMap()) map.fail(joints, "joints should be a map of joints");
    for (const auto& joint : joints) {
      const auto name = joint.first.as<std::string>();
      limits.joints[name] = jointLimits(map.map(joint.second, "joint " + name, keys));
    }
  }
  if (map.has("other_joints")) {
    limits.other_joints = jointLimits(map.map(map.at("other_joints"), "other_joints", keys));
  }
  return limits;
}

}  // namespace afterglow::nodes

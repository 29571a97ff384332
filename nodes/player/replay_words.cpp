#include "nodes/player/replay_words.hpp"

#include <stdexcept>

#include "nodes/player/robot_file.hpp"

namespace afterglow::nodes {
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

#include "replay/record/snapshot.hpp"

#include <nlohmann/json.hpp>

#include "replay/messages/foreign_json.hpp"

namespace afterglow::replay {
namespace {

std::set<std::string> textsOf(const nlohmann::json& object, const char* key) {
  std::set<std::string> texts;
  if (!object.contains(key)) return texts;
  for (const auto& text : object[key]) {
    if (text.is_string()) texts.insert(text.get<std::string>());
  }
  return texts;
}

/// A member of the snapshot; empty if it is not there.
std::string textOf(const Behavior& behavior, const char* member) {
  const auto json = parseForeignJson(behavior.snapshot);
  const bool is_kept = json.is_object() && json.contains(member) && json[member].is_string();
  return is_kept ? json[member].get<std::string>() : std::string();
}

}  // namespace

std::string Snapshot::toJson() const {
  nlohmann::json json = nlohmann::json::object();
  if (!begin.empty()) json["frames"]["begin"] = begin;
  if (!end.empty()) json["frames"]["end"] = end;
  if (!urdf.empty()) json["urdf"] = urdf;
  if (!map.empty()) json["map"] = map;
  if (robot) {
    json["robot"] = {{"namespace", robot->name_space}, {"tf_prefix", robot->frame_prefix}};
  }
  if (!files.empty()) json["files"] = files;
  if (!requested.empty()) json["request"]["topics"] = requested;
  for (const auto& [topic, around] : nodes) {
    nlohmann::json& noted = json["nodes"][topic];
    noted = nlohmann::json::object();
    if (!around.type.empty()) noted["type"] = around.type;
    if (!around.publishers.empty()) noted["publishers"] = around.publishers;
    if (!around.subscribers.empty()) noted["subscribers"] = around.subscribers;
  }
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string recordedUrdf(const Behavior& behavior) { return textOf(behavior, "urdf"); }
std::string recordedMap(const Behavior& behavior) { return textOf(behavior, "map"); }

std::optional<RobotNames> recordedRobot(const Behavior& behavior) {
  const auto json = parseForeignJson(behavior.snapshot);
  const auto text = [&json](const char* where) {
    const nlohmann::json::json_pointer member(where);
    const bool is_kept = json.is_object() && json.contains(member) && json[member].is_string();
    return is_kept ? json[member].get<std::string>() : std::string();
  };
  const bool is_told = json.is_object() && json.contains("robot") && json["robot"].is_object();
  if (!is_told) return std::nullopt;
  return RobotNames{cleanNamespace(text("/robot/namespace")), text("/robot/tf_prefix")};
}

std::vector<std::string> requestedTopics(const Behavior& behavior) {
  const auto json = parseForeignJson(behavior.snapshot);
  const nlohmann::json::json_pointer where("/request/topics");
  std::vector<std::string> topics;
  if (!json.is_object() || !json.contains(where)) return topics;
  for (const auto& topic : json[where]) {
    if (topic.is_string()) topics.push_back(topic.get<std::string>());
  }
  return topics;
}

RecordedNodes recordedNodes(const Behavior& behavior) {
  const auto json = parseForeignJson(behavior.snapshot);
  RecordedNodes nodes;
  if (!json.is_object() || !json.contains("nodes") || !json["nodes"].is_object()) return nodes;
  for (const auto& [topic, noted] : json["nodes"].items()) {
    if (!noted.is_object()) continue;
    const auto type = noted.find("type");
    nodes[topic] = {type != noted.end() && type->is_string() ? type->get<std::string>() : "",
                    textsOf(noted, "publishers"), textsOf(noted, "subscribers")};
  }
  return nodes;
}

void addNodes(RecordedNodes& nodes, const RecordedNodes& others) {
  for (const auto& [topic, other] : others) {
    TopicNodes& own = nodes[topic];
    if (own.type.empty()) own.type = other.type;
    own.publishers.insert(other.publishers.begin(), other.publishers.end());
    own.subscribers.insert(other.subscribers.begin(), other.subscribers.end());
  }
}

}  // namespace afterglow::replay

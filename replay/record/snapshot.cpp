#include "replay/record/snapshot.hpp"

#include <nlohmann/json.hpp>

namespace afterglow::replay {

std::string Snapshot::toJson() const {
  nlohmann::json json = nlohmann::json::object();
  if (!begin.empty()) json["frames"]["begin"] = begin;
  if (!end.empty()) json["frames"]["end"] = end;
  if (!urdf.empty()) json["urdf"] = urdf;
  if (!files.empty()) json["files"] = files;
  if (!requested.empty()) json["request"]["topics"] = requested;
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::vector<std::string> requestedTopics(const Behavior& behavior) {
  const auto json = nlohmann::json::parse(behavior.snapshot, nullptr, false);
  const nlohmann::json::json_pointer where("/request/topics");
  std::vector<std::string> topics;
  if (!json.is_object() || !json.contains(where)) return topics;
  for (const auto& topic : json[where]) {
    if (topic.is_string()) topics.push_back(topic.get<std::string>());
  }
  return topics;
}

}  // namespace afterglow::replay

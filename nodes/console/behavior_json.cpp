#include "nodes/console/behavior_json.hpp"

#include "nodes/console/http_message.hpp"
#include "replay/messages/foreign_json.hpp"

namespace afterglow::nodes {

std::string stampText(replay::Stamp stamp) { return std::to_string(stamp.ns); }

nlohmann::ordered_json behaviorJson(const IndexedBehavior& one) {
  const replay::Behavior& behavior = one.behavior;
  auto parameters = replay::parseForeignJson<nlohmann::ordered_json>(behavior.parameters);
  if (parameters.is_discarded()) parameters = nullptr;
  auto said = nlohmann::ordered_json::array();
  for (const SaidSentence& sentence : one.said) said.push_back(sentence.text);
  nlohmann::ordered_json json = {
      {"id", behavior.id},
      {"name", behavior.name},
      {"outcome", behavior.outcome},
      {"begin", stampText(behavior.begin)},
      {"end", nullptr},
      {"duration", static_cast<double>(one.end.ns - behavior.begin.ns) * 1e-9},
      {"said", said},
      {"tags", behavior.tags},
      {"tree_path", behavior.tree_path},
      {"attempt", behavior.attempt},
      {"parent", nullptr},
      {"robot", behavior.robot},
      {"notes", one.notes},
      {"remarks", behavior.remarks},
      {"messages", one.messages},
      {"parameters", parameters}};
  if (behavior.end) json["end"] = stampText(*behavior.end);
  if (behavior.parent != 0) json["parent"] = behavior.parent;
  return json;
}

HttpResponse jsonResponse(const nlohmann::ordered_json& json) {
  return {200, "application/json",
          json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)};
}

}  // namespace afterglow::nodes

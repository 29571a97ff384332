#include "replay/play/play_report.hpp"

#include <nlohmann/json.hpp>

namespace afterglow::replay {
namespace {

using Json = nlohmann::ordered_json;

double milliseconds(double ns) { return ns * 1e-6; }
double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

Json rewritten(const PlannedTopic& topic) {
  Json fields = Json::array();
  for (const RewrittenField& field : topic.rewrites) {
    fields.push_back({{"field", field.path},
                      {"rule", std::string(describe(field.rule))},
                      {"count", field.count}});
  }
  return fields;
}

Json planned(const PlannedTopic& topic) {
  Json json = {{"type", topic.channel.type}, {"count", topic.count}};
  if (!topic.isPlayed()) {
    json["not_played"] = topic.why_not;
    return json;
  }
  json["modality"] = std::string(name(topic.modality));
  if (topic.output.topic != topic.channel.topic) json["published_as"] = topic.output.topic;
  json["rewritten"] = rewritten(topic);
  return json;
}

Json played(const PlannedTopic& topic, const TopicReport& report) {
  Json json = planned(topic);
  if (!topic.isPlayed()) {
    return json;
  }
  const Lateness& lateness = report.lateness;
  const auto quantile = [&](double q) {
    return milliseconds(static_cast<double>(lateness.quantile(q)));
  };
  json["published"] = report.published;
  json["skipped"] = report.skipped;
  json["refused"] = report.refused;
  if (!report.problem.empty()) json["problem"] = report.problem;
  json["heard"] = report.was_heard;
  json["lateness_ms"] = {{"p50", quantile(0.5)},
                         {"p99", quantile(0.99)},
                         {"max", milliseconds(static_cast<double>(lateness.max()))}};
  json["drift_ms"] = milliseconds(lateness.drift());
  return json;
}

}  // namespace

void InStep::add(const PlayWait& wait) {
  if (waits.size() < kMostWaits) waits.push_back(wait);
  ++wait_count;
  waited_s += wait.seconds;
}

Json toJson(const PlayReport& report) {
  Json json = {{"completed", report.is_complete},
               {"reason", report.reason},
               {"notes", report.notes},
               {"scheduling", report.scheduling},
               {"planned_s", seconds(report.planned_ns)},
               {"actual_s", seconds(report.actual_ns)}};
  json["goals"] = {{"sent", report.goals.sent},
                   {"succeeded", report.goals.succeeded},
                   {"failed", report.goals.failed},
                   {"canceled", report.goals.canceled}};
  json["topics"] = Json::object();
  for (const auto& [topic, topic_report] : report.topics) {
    json["topics"][topic.channel.topic] = played(topic, topic_report);
  }
  return json;
}

Json toJson(const PlayPlan& plan) {
  Json json = {{"behavior_id", plan.behavior.id},
               {"name", plan.behavior.name},
               {"duration_s", seconds(plan.durationNs())},
               {"begin_s", seconds(plan.begin.ns - plan.behavior.begin.ns)}};
  json["topics"] = Json::object();
  for (const PlannedTopic& topic : plan.topics) {
    json["topics"][topic.channel.topic] = planned(topic);
  }
  return json;
}

}  // namespace afterglow::replay

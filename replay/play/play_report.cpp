#include "replay/play/play_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace afterglow::replay {
namespace {

using Json = nlohmann::ordered_json;

double milliseconds(double ns) { return ns * 1e-6; }
double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

double quantileMs(const Lateness& lateness, double q) {
  return milliseconds(static_cast<double>(lateness.quantile(q)));
}

double maxMs(const Lateness& lateness) { return milliseconds(static_cast<double>(lateness.max())); }

Json rewritten(const PlannedTopic& topic) {
  Json fields = Json::array();
  for (const RewrittenField& field : topic.rewrites) {
    fields.push_back({{"field", field.path},
                      {"rule", std::string(describe(field.rule))},
                      {"count", field.count}});
  }
  return fields;
}

/// Returns the text of a stop; empty for a state that moves nothing, and for endless motion, which
/// a type's stop does not help. Empty for a state that moves nothing.
std::string stopText(const PlannedTopic& topic) {
  const bool is_endless = topic.topic_class == TopicClass::Endless;
  const MotionStop stop = is_endless ? MotionStop() : stopOf(topic);
  const bool is_motion = is_endless || topic.isPlayed() || stop.kind != StopKind::None;
  return topic.modality == Modality::Body && is_motion ? describe(stop) : "";
}

Json planned(const PlannedTopic& topic) {
  Json json = {{"type", topic.channel.type},
               {"count", topic.count},
               {"class", std::string(name(topic.topic_class))},
               {"why", topic.why_class}};
  if (std::string stop = stopText(topic); !stop.empty()) json["stop"] = std::move(stop);
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
  json["published"] = report.published;
  json["skipped"] = report.skipped;
  json["refused"] = report.refused;
  if (!report.problem.empty()) json["problem"] = report.problem;
  if (report.replaced > 0) json["replaced"] = report.replaced;
  json["heard"] = nullptr;  // of what was sent
  if (report.published > 0) json["heard"] = report.was_heard;
  json["lateness_ms"] = {{"p50", quantileMs(report.lateness, 0.5)},
                         {"p99", quantileMs(report.lateness, 0.99)},
                         {"max", maxMs(report.lateness)}};
  json["drift_ms"] = milliseconds(report.lateness.drift());
  return json;
}

Json inStep(const InStep& in_step) {
  Json skew = Json::object();
  for (const auto& [modality, measured] : in_step.skew) {
    skew[std::string(name(modality))] = {{"messages", measured.size.count()},
                                         {"p50", quantileMs(measured.size, 0.5)},
                                         {"p95", quantileMs(measured.size, 0.95)},
                                         {"max", maxMs(measured.size)}};
  }
  return {{"gated", in_step.is_gated},
          {"waits", in_step.wait_count},
          {"waited_s", in_step.waited_s},
          {"skew_ms", skew}};
}

Json failures(const PlayReport& report) {
  Json json = Json::object();
  for (const auto& [modality, failed] : report.failures) {
    json[std::string(name(modality))] = {{"count", failed.count}, {"first", failed.first}};
  }
  return json;
}

Json goals(const GoalBook::Counts& counts) {
  return {{"sent", counts.sent},
          {"succeeded", counts.succeeded},
          {"failed", counts.failed},
          {"canceled", counts.canceled}};
}

void addDrives(const BaseDriveReport& driven, Json& json) {
  const DriveSummary summary = summaryOf(driven);
  json["localized"] = driven.is_localized;
  json["length_m"] = driven.length;
  json["drives"] = driven.drives.size();
  json["largest_deviation_m"] = summary.largest_distance;
  json["drift_m"] = summary.drift_distance;
  json["drift_deg"] = summary.drift_turn * kDegreesPerRadian;
  json["corrections"] = summary.corrections;
  json["delay_s"] = driven.delay;
  json["waited_for_poses_s"] = driven.waited;
  if (driven.obstacles.waited > 0) json["waited_for_obstacles_s"] = driven.obstacles.waited;
  if (!driven.lost.empty()) json["lost"] = driven.lost;
}

Json base(const PlayReport& report) {
  Json json = Json::object();
  if (const auto end = baseEnd(report)) {
    json["distance_m"] = end->distance;
    json["turn_deg"] = end->turn * kDegreesPerRadian;
    if (end->doubt.position > 0) {
      json["uncertainty_m"] = end->doubt.position;
      json["uncertainty_deg"] = end->doubt.yaw * kDegreesPerRadian;
      json["localized_m_ago"] = end->gone_since_localized;
    }
  }
  if (report.base) {
    json["topic"] = report.base->topic;
    json["closed_loop"] = report.base->driven.has_value();
    if (!report.base->why_open_loop.empty()) json["why_open_loop"] = report.base->why_open_loop;
    if (report.base->driven) addDrives(*report.base->driven, json);
  }
  return json;
}

Json body(const PlayReport& report) {
  Json json = {{"joints", Json::object()}};
  if (report.body_end) {
    for (const auto& [joint, error] : report.body_end->joints) json["joints"][joint] = error;
    if (const auto worst = worstJoint(*report.body_end)) {
      json["worst"] = {{"joint", worst->first}, {"error", worst->second}};
    }
    json["not_known"] = report.body_end->remarks;
  }
  if (report.base || baseEnd(report)) json["base"] = base(report);
  return json;
}

Json guards(const PlayGuards& guards) {
  Json json = {{"patience_ms", guards.patience_ms},
               {"lateness_ms", guards.lateness_ms},
               {"waiting", std::round(guards.waiting * 100) / 100}};
  if (guards.on_robot) {
    json["on_robot"] = {{"node", guards.on_robot->node},
                        {"patience_ms", guards.on_robot->patience_ms},
                        {"longest_gap_ms", guards.on_robot->longest_gap_ms},
                        {"over_network", guards.on_robot->is_afar}};
  }
  return json;
}

/// The planned messages that were not sent, with the reason.
Json losses(const PlayReport& report, std::uint64_t TopicReport::*count) {
  Json json = Json::array();
  for (const auto& [topic, played_topic] : report.topics) {
    if (played_topic.*count == 0) continue;
    const bool is_refused = count == &TopicReport::refused;
    json.push_back({{"topic", topic.channel.topic},
                    {"count", played_topic.*count},
                    {"why", is_refused ? played_topic.problem : std::string(kWhySkipped)}});
  }
  return json;
}

}  // namespace

void PlayReport::note(const std::vector<std::string>& texts) {
  for (const std::string& text : texts) {
    if (!text.empty()) notes.push_back(text);
  }
}

void InStep::add(const PlayWait& wait) {
  if (waits.size() < kMostWaits) waits.push_back(wait);
  ++wait_count;
  waited_s += wait.seconds;
}

std::vector<std::string> unheardNotes(const std::vector<std::string>& unheard,
                                      const PlayReport& report) {
  std::vector<std::string> notes;
  std::string unsent;
  bool is_any_sent = false;
  for (const auto& [planned, topic] : report.topics) {
    const std::string& name = planned.output.topic;
    is_any_sent = is_any_sent || topic.published > 0;
    if (std::find(unheard.begin(), unheard.end(), name) == unheard.end()) continue;
    if (topic.published > 0) {
      notes.push_back("nobody listened on " + name + " at the start");
    } else {
      unsent += (unsent.empty() ? "" : ", ") + name;
    }
  }
  if (!is_any_sent) return {"nothing was sent"};
  if (!unsent.empty()) notes.push_back("nothing was sent on " + unsent);
  return notes;
}

std::optional<std::pair<std::string, double>> worstJoint(const BodyEnd& end) {
  const auto worst = std::max_element(
      end.joints.begin(), end.joints.end(),
      [](const auto& a, const auto& b) { return std::abs(a.second) < std::abs(b.second); });
  return worst == end.joints.end() ? std::nullopt : std::optional(std::pair(*worst));
}

std::optional<BodyEnd::Base> baseEnd(const PlayReport& report) {
  if (report.base && report.base->driven && !report.base->driven->drives.empty()) {
    const DriveReport& last = report.base->driven->drives.back();
    if (last.state == BaseState::Done) {
      return BodyEnd::Base{last.base.end_distance, std::abs(last.base.end_turn),
                           last.base.end_doubt, last.base.gone_since_localized};
    }
  }
  return report.body_end ? report.body_end->base : std::nullopt;
}

DriveSummary summaryOf(const BaseDriveReport& driven) {
  DriveSummary summary;
  for (const DriveReport& drive : driven.drives) {
    const BaseReport& one = drive.base;
    summary.largest_distance = std::max(summary.largest_distance, one.largest_distance);
    summary.drift_distance = std::max(summary.drift_distance, one.drift_distance);
    summary.drift_turn = std::max(summary.drift_turn, std::abs(one.drift_turn));
    summary.corrections += one.corrections;
  }
  return summary;
}

std::vector<std::string> toText(const PlayGuards& guards) {
  std::vector<std::string> lines{
      fmt::format("the watchdog stops the robot when the player is silent for {:.0f} ms in motion "
                  "(this machine was up to {:.1f} ms late, and programs waited for a processor "
                  "{:.0f} % of the time)",
                  guards.patience_ms, guards.lateness_ms, 100 * guards.waiting)};
  if (guards.on_robot) {
    lines.push_back(fmt::format(
        "the guard on the robot, {}, stops it after {:.0f} ms of silence ({}; heartbeats got there "
        "up to {:.0f} ms apart)",
        guards.on_robot->node, guards.on_robot->patience_ms,
        guards.on_robot->is_afar ? "over the network" : "beside the player",
        guards.on_robot->longest_gap_ms));
  }
  return lines;
}

Json toJson(const PlayReport& report) {
  Json json = {{"behavior_id", report.behavior_id},
               {"name", report.behavior_name},
               {"completed", report.is_complete},
               {"reason", report.reason},
               {"notes", report.notes},
               {"scheduling", report.scheduling},
               {"begin_s", report.begin_s},
               {"rate", report.rate},
               {"planned_s", seconds(report.planned_ns)},
               {"actual_s", seconds(report.actual_ns)},
               {"goals", goals(report.goals)},
               {"in_step", inStep(report.in_step)},
               {"body", body(report)},
               {"failures", failures(report)},
               {"dropped", losses(report, &TopicReport::skipped)},
               {"refused", losses(report, &TopicReport::refused)}};
  if (report.guards) json["guards"] = guards(*report.guards);
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

// The report as a page: demo_report.hpp's reportHtml().

#include "nodes/kitting/demo_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "nodes/pages/page.hpp"
#include "nodes/pages/page_numbers.hpp"
#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {
namespace {

BehaviorStory readBehavior(const std::string& file, const YAML::Node& name,
                           const YAML::Node& node) {
  const YamlMap values(file, node, "behavior '" + name.Scalar() + "'",
                       {"title", "caption", "question", "explanation", "light", "says", "moments"});
  BehaviorStory story;
  story.name = name.Scalar();
  story.title = values.text("title");
  story.caption = values.text("caption");
  story.question = values.text("question");
  story.explanation = values.text("explanation");
  story.light = values.text("light");
  story.says = values.text("says");
  const YAML::Node moments = values.at("moments");
  if (!moments.IsMap()) values.fail(moments, "'moments' should be a map of names and texts");
  for (const auto& moment : moments) {
    if (!moment.second.IsScalar()) values.fail(moment.second, "a moment should have a text");
    story.moments.emplace_back(moment.first.Scalar(), moment.second.Scalar());
  }
  return story;
}

}  // namespace

DemoStory loadDemoStory(const std::string& path) {
  const YamlMap values(path, loadYaml(path), "the story", {"title", "subtitle", "behaviors"});
  DemoStory story;
  story.title = values.text("title");
  story.subtitle = values.text("subtitle");
  const YAML::Node behaviors = values.at("behaviors");
  if (!behaviors.IsMap()) values.fail(behaviors, "'behaviors' should be a map of names");
  for (const auto& behavior : behaviors) {
    story.behaviors.push_back(readBehavior(path, behavior.first, behavior.second));
  }
  return story;
}

namespace {

using nlohmann::json;

double rounded(double value, double step) { return std::round(value / step) * step; }

json poseJson(const EndPose& pose) {
  return {{"x_m", rounded(pose.base.x, 1e-4)},
          {"y_m", rounded(pose.base.y, 1e-4)},
          {"yaw_deg", rounded(pose.base.yaw * 180 / M_PI, 1e-2)},
          {"gripper_m",
           {rounded(pose.p_gripper.x(), 1e-4), rounded(pose.p_gripper.y(), 1e-4),
            rounded(pose.p_gripper.z(), 1e-4)}}};
}

json topicsJson(const std::vector<replay::TopicSummary>& topics) {
  json result = json::object();
  for (const replay::TopicSummary& topic : topics) {
    result[topic.topic] = {{"type", topic.type}, {"count", topic.count}};
  }
  return result;
}

json keyFramesJson(const std::vector<KeyFrame>& frames) {
  json result = json::array();
  for (const KeyFrame& frame : frames) {
    result.push_back({{"moment", frame.moment},
                      {"offset_s", rounded(frame.offset_s, 1e-3)},
                      {"live", frame.live},
                      {"replay", frame.replay}});
  }
  return result;
}

json behaviorJson(const MeasuredBehavior& measured) {
  const replay::Behavior& behavior = measured.behavior;
  const EndError error = endError(measured.live_end, measured.replay_end);
  const ReplayLateness late = latenessOf(measured.player_report);
  return {{"id", behavior.id},
          {"name", behavior.name},
          {"tree_path", behavior.tree_path},
          {"outcome", behavior.outcome},
          {"begin_ns", behavior.begin.ns},
          {"end_ns", behavior.end ? json(behavior.end->ns) : json()},
          {"duration_s", rounded(durationOf(behavior), 1e-3)},
          {"says", measured.says},
          {"film", measured.film},
          {"messages", measured.messages},
          {"dropped", measured.dropped},
          {"topics", topicsJson(measured.topics)},
          {"key_frames", keyFramesJson(measured.key_frames)},
          {"replay",
           {{"id", measured.replay_id},
            {"duration_s", rounded(measured.replay_s, 1e-3)},
            {"lateness_ms",
             {{"median", rounded(late.median_ms, 1e-3)},
              {"p99", rounded(late.p99_ms, 1e-3)},
              {"max", rounded(late.max_ms, 1e-3)}}},
            {"end_error",
             {{"base_cm", rounded(error.base_cm, 1e-2)},
              {"heading_deg", rounded(error.heading_deg, 1e-2)},
              {"gripper_cm", rounded(error.gripper_cm, 1e-2)}}},
            {"recorded_end", poseJson(measured.live_end)},
            {"replayed_end", poseJson(measured.replay_end)},
            {"player", measured.player_report}}}};
}

}  // namespace

EndError endError(const EndPose& recorded, const EndPose& replayed) {
  const replay::PlanarPose base = between(recorded.base, replayed.base);
  return {std::hypot(base.x, base.y) * 100, std::abs(base.yaw) * replay::kDegreesPerRadian,
          (recorded.p_gripper - replayed.p_gripper).norm() * 100};
}

ReplayLateness latenessOf(const json& player_report) {
  ReplayLateness worst;
  try {
    for (const auto& [name, topic] : player_report.at("topics").items()) {
      if (!topic.contains("lateness_ms")) continue;
      const json& late = topic.at("lateness_ms");
      worst.median_ms = std::max(worst.median_ms, late.at("p50").get<double>());
      worst.p99_ms = std::max(worst.p99_ms, late.at("p99").get<double>());
      worst.max_ms = std::max(worst.max_ms, late.at("max").get<double>());
    }
  } catch (const json::exception& error) {
    throw std::runtime_error(std::string("the player's report has no lateness: ") + error.what());
  }
  return worst;
}

double durationOf(const replay::Behavior& behavior) {
  return behavior.end ? static_cast<double>(behavior.end->ns - behavior.begin.ns) * 1e-9 : 0;
}

std::vector<std::string> filmArguments(const MeasuredBehavior& measured,
                                       const std::string& assets) {
  return {"render",
          std::to_string(measured.replay_id),
          "--film",
          "--beside",
          std::to_string(measured.behavior.id),
          "--config",
          assets + "/projector.yaml",
          "--room",
          assets + "/view.yaml",
          "--place",
          measured.behavior.name};
}

std::vector<std::string> commandsToTry(const DemoReport& report) {
  std::vector<std::string> commands = {
      "export AFTERGLOW_STORE=" + report.folder + "/" + report.store, report.command + " list"};
  if (report.behaviors.empty()) return commands;
  const MeasuredBehavior& first = report.behaviors.front();
  const std::string id = std::to_string(first.behavior.id);
  commands.push_back(report.command + " show " + id);
  commands.push_back(report.command + " play " + first.behavior.name + " --dry-run");
  commands.push_back(fmt::format("{} {} --out {}/{}_film.mp4", report.command,
                                 fmt::join(filmArguments(first, report.assets), " "), report.folder,
                                 first.behavior.name));
  return commands;
}

json summaryJson(const DemoReport& report) {
  json versions = json::object();
  for (const auto& [what, version] : report.versions) versions[what] = version;
  json behaviors = json::array();
  for (const MeasuredBehavior& each : report.behaviors) behaviors.push_back(behaviorJson(each));
  return {
      {"date", report.date},   {"versions", versions},  {"duration_s", rounded(report.wall_s, 0.1)},
      {"video", report.video}, {"store", report.store}, {"behaviors", behaviors}};
}

namespace {

/// "shoulder_pan_joint -0.12°"; null where the player knows of none.
PageData worstJointText(const nlohmann::json& player_report) {
  const nlohmann::json worst =
      player_report.value(nlohmann::json::json_pointer("/body/worst"), nlohmann::json::object());
  if (!worst.contains("joint")) return nullptr;
  const auto joint = worst.at("joint").get<std::string>();
  const bool is_sliding = replay::RobotJoints().isSliding(joint);
  return joint + " " + jointErrorText(is_sliding, worst.at("error").get<double>(), "°");
}

/// A replayed moment in the middle of the first behavior.
std::string posterOf(const DemoReport& report) {
  if (report.behaviors.empty() || report.behaviors.front().key_frames.empty()) return "";
  const auto& frames = report.behaviors.front().key_frames;
  return frames[frames.size() / 2].replay;
}

void addStory(const DemoStory& story, PageData& behavior) {
  BehaviorStory told;
  for (const BehaviorStory& each : story.behaviors) {
    if (each.name == behavior["name"]) told = each;
  }
  behavior["title"] = told.title;
  behavior["question"] = told.question;
  behavior["explanation"] = told.explanation;
  for (PageData& frame : behavior["key_frames"]) {
    frame["text"] = "";
    for (const auto& [moment, words] : told.moments) {
      if (moment == frame["moment"]) frame["text"] = words;
    }
  }
}

}  // namespace

std::string reportHtml(const DemoReport& report, const DemoStory& story) {
  PageData data = summaryJson(report);
  data["page_title"] = data["title"] = story.title;
  data["under"] = story.subtitle;
  data["poster"] = posterOf(report);
  for (std::size_t i = 0; i < report.behaviors.size(); ++i) {
    PageData& behavior = data["behaviors"][i];
    addStory(story, behavior);
    const auto& frames = report.behaviors[i].key_frames;
    behavior["poster"] = frames.empty() ? "" : frames[frames.size() / 2].replay;
    behavior["topic_count"] = report.behaviors[i].topics.size();
    behavior["worst_joint"] = worstJointText(report.behaviors[i].player_report);
  }
  data["commands"] = commandsToTry(report);
  return makePage("demo.html", std::move(data));
}

}  // namespace afterglow::nodes

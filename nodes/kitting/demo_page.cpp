// The report as a page: demo_report.hpp's reportHtml().
#include "nodes/kitting/demo_report.hpp"
#include "nodes/pages/page.hpp"
#include "nodes/pages/page_numbers.hpp"

namespace afterglow::nodes {
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

// The report as a page: demo_report.hpp's reportHtml().
#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "calib/report/html.hpp"
#include "nodes/kitting/demo_report.hpp"
#include "replay/motion/start_pose.hpp"

namespace afterglow::nodes {
namespace {

using calib::escaped;

constexpr const char* kStyle = R"css(
:root { --ink: #1c2230; --soft: #5d6678; --paper: #f6f4ef; --card: #ffffff; --line: #e4e0d6; --glow: #c2410c; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 17px/1.6 "Source Sans 3", "Segoe UI", "Helvetica Neue", Arial, sans-serif; }
main, header > div { max-width: 1080px; margin: 0 auto; padding: 0 24px; }
header { background: #141824; color: #f4f1ea; padding: 56px 0 88px; }
header h1 { font-size: 46px; line-height: 1.1; margin: 0 0 10px; letter-spacing: -0.02em; }
header p { font-size: 21px; margin: 0; color: #c9cdd8; }
video { display: block; width: 100%; border-radius: 14px; margin: -56px 0 20px; background: #000;
  box-shadow: 0 18px 50px rgba(20, 24, 36, .35); }
h2 { font-size: 29px; line-height: 1.2; margin: 64px 0 4px; letter-spacing: -0.01em; }
.question { color: var(--glow); font-size: 19px; margin: 0 0 12px; }
.says { border-left: 4px solid var(--glow); margin: 16px 0; padding: 2px 0 2px 16px; font-size: 19px; }
.frames { display: grid; gap: 18px; margin: 24px 0 8px; }
.frame { background: var(--card); border: 1px solid var(--line); border-radius: 14px; overflow: hidden; }
.pair { display: grid; grid-template-columns: 1fr 1fr; gap: 2px; background: var(--line); }
.pair figure { margin: 0; background: var(--card); position: relative; }
.pair img { display: block; width: 100%; height: auto; }
.pair figcaption { position: absolute; left: 10px; top: 10px; padding: 1px 10px; border-radius: 99px;
  background: rgba(20, 24, 36, .78); color: #fff; font-size: 14px; }
.frame > p { margin: 0; padding: 10px 16px 12px; color: var(--soft); }
.frame > p b { color: var(--ink); }
table { border-collapse: collapse; width: 100%; margin: 14px 0; background: var(--card);
  border: 1px solid var(--line); border-radius: 12px; overflow: hidden; font-size: 15px; }
th, td { text-align: left; padding: 7px 14px; border-top: 1px solid var(--line); }
tr:first-child > * { border-top: 0; }
th { color: var(--soft); font-weight: 600; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
code, pre { font: 14px/1.5 ui-monospace, "DejaVu Sans Mono", Menlo, monospace; }
pre { background: #141824; color: #e8e5de; padding: 16px 20px; border-radius: 12px; overflow-x: auto; }
details { margin: 10px 0; } summary { cursor: pointer; color: var(--soft); }
footer { color: var(--soft); font-size: 14px; padding: 48px 0 64px; }
@media (max-width: 700px) { .pair { grid-template-columns: 1fr; } header h1 { font-size: 36px; } }
)css";

void writeFigure(std::ostream& page, const std::string& name, const std::string& label,
                 const std::string& alt) {
  page << "<figure><img src=\"frames/" << escaped(name) << ".png\" alt=\"" << escaped(alt)
       << "\" loading=\"lazy\"><figcaption>" << label << "</figcaption></figure>";
}

void writeFrames(std::ostream& page, const MeasuredBehavior& measured, const BehaviorStory& story) {
  page << "<div class=\"frames\">\n";
  for (const KeyFrame& frame : measured.key_frames) {
    std::string text;
    for (const auto& [moment, words] : story.moments) {
      if (moment == frame.moment) text = words;
    }
    page << "<div class=\"frame\"><div class=\"pair\">";
    writeFigure(page, frame.live, "recorded", "Recorded: " + text);
    writeFigure(page, frame.replay, "replayed",
                "Replayed, with the objects gone, at the same moment: " + text);
    page << "</div><p><b>" << fmt::format("{:.1f} s, ", frame.offset_s) << escaped(frame.moment)
         << ".</b> " << escaped(text) << "</p></div>\n";
  }
  page << "</div>\n";
}

void writeTopics(std::ostream& page, const MeasuredBehavior& measured) {
  page << "<details><summary>" << measured.messages << " messages recorded on "
       << measured.topics.size() << " topics</summary>\n<table><tr><th>Topic</th><th>Type</th>"
       << "<th class=\"n\">Messages</th></tr>\n";
  for (const replay::TopicSummary& topic : measured.topics) {
    page << "<tr><td><code>" << escaped(topic.topic) << "</code></td><td><code>"
         << escaped(topic.type) << "</code></td><td class=\"n\">" << topic.count << "</td></tr>\n";
  }
  page << "</table></details>\n";
}

void writeBehavior(std::ostream& page, const MeasuredBehavior& measured,
                   const BehaviorStory& story) {
  page << "<section>\n<h2>" << escaped(story.title) << "</h2>\n<p class=\"question\">"
       << escaped(story.question) << "</p>\n<p>" << escaped(story.explanation)
       << "</p>\n<p class=\"says\">&ldquo;" << escaped(measured.says) << "&rdquo;</p>\n";
  writeFrames(page, measured, story);
  writeTopics(page, measured);
  page << "</section>\n";
}

void writeMeasurements(std::ostream& page, const DemoReport& report) {
  page
      << "<section>\n<h2>Measured</h2>\n<p>Lateness is how long after its planned moment a message "
         "was sent in the replay. The end error is how far the simulated robot ended from where it "
         "had ended when it was recorded.</p>\n<table>\n"
         "<tr><th>Behavior</th><th class=\"n\">Recorded</th><th class=\"n\">Messages</th>"
         "<th class=\"n\">Dropped</th><th class=\"n\">Replayed in</th><th class=\"n\">Lateness "
         "p50 / p99 / max</th><th class=\"n\">End error: base</th><th class=\"n\">heading</th>"
         "<th class=\"n\">gripper</th></tr>\n";
  for (const MeasuredBehavior& each : report.behaviors) {
    const ReplayLateness late = latenessOf(each.player_report);
    const EndError error = endError(each.live_end, each.replay_end);
    page << "<tr><td>" << escaped(each.behavior.name) << "</td>"
         << fmt::format(
                "<td class=\"n\">{:.1f} s</td><td class=\"n\">{}</td><td class=\"n\">{}</td>"
                "<td class=\"n\">{:.1f} s</td><td class=\"n\">{:.2f} / {:.2f} / {:.2f} ms</td>"
                "<td class=\"n\">{:.1f} cm</td><td class=\"n\">{:.1f}&deg;</td>"
                "<td class=\"n\">{:.1f} cm</td></tr>\n",
                durationOf(each.behavior), each.messages, each.dropped, each.replay_s,
                late.median_ms, late.p99_ms, late.max_ms, error.base_cm, error.heading_deg,
                error.gripper_cm);
  }
  page << "</table>\n</section>\n";
}

/// A number of the player's report, times `factor`; "-" where it has none.
std::string reported(const nlohmann::json& report, const char* where, double factor, int digits,
                     const char* unit) {
  const nlohmann::json::json_pointer pointer(where);
  if (!report.contains(pointer) || !report.at(pointer).is_number()) return "-";
  return fmt::format("{:.{}f}{}", report.at(pointer).get<double>() * factor, digits, unit);
}

/// "shoulder_pan_joint -0.12&deg;"
std::string worstJoint(const nlohmann::json& report) {
  const nlohmann::json worst =
      report.value(nlohmann::json::json_pointer("/body/worst"), nlohmann::json::object());
  const std::string joint = worst.value("joint", "");
  if (joint.empty()) return "-";
  const bool is_sliding = replay::isSlidingJoint(joint);
  return escaped(joint) + " " +
         reported(worst, "/error", is_sliding ? 1000 : 180 / M_PI, is_sliding ? 1 : 2,
                  is_sliding ? " mm" : "&deg;");
}

void writeInStep(std::ostream& page, const DemoReport& report) {
  page << "<section>\n<h2>In step with the body</h2>\n<p>What the player says itself. Light and "
          "speech wait for the body; skew is how far from their recorded moments they were sent, "
          "relative to it. The base follows its recorded poses; its drift is what had to be "
          "corrected on the way.</p>\n<table>\n<tr><th>Behavior</th><th class=\"n\">Waited</th>"
          "<th class=\"n\">Skew p95: light</th><th class=\"n\">speech</th>"
          "<th class=\"n\">Base: drift</th><th class=\"n\">at the end</th>"
          "<th class=\"n\">Farthest joint at the end</th></tr>\n";
  for (const MeasuredBehavior& each : report.behaviors) {
    const nlohmann::json& player = each.player_report;
    const auto cell = [&](const std::string& text) {
      page << "<td class=\"n\">" << text << "</td>";
    };
    page << "<tr><td>" << escaped(each.behavior.name) << "</td>";
    cell(reported(player, "/in_step/waited_s", 1, 1, " s"));
    cell(reported(player, "/in_step/skew_ms/ar/p95", 1, 1, " ms"));
    cell(reported(player, "/in_step/skew_ms/speech/p95", 1, 1, " ms"));
    cell(reported(player, "/body/base/drift_m", 100, 1, " cm"));
    const std::string turn = reported(player, "/body/base/turn_deg", 1, 1, "&deg;");
    cell(reported(player, "/body/base/distance_m", 100, 1, " cm") +
         (turn == "-" ? "" : ", " + turn));
    cell(worstJoint(player));
    page << "</tr>\n";
  }
  page << "</table>\n</section>\n";
}

void writeTryIt(std::ostream& page, const DemoReport& report) {
  page << "<section>\n<h2>Try it</h2>\n<p>Everything that was recorded is in <code>"
       << escaped(report.store) << "</code>.</p>\n<pre>";
  for (const std::string& command : commandsToTry(report)) page << escaped(command) << "\n";
  page << "</pre>\n</section>\n";
}

void writeFooter(std::ostream& page, const DemoReport& report) {
  page << "<footer>" << escaped(report.date) << " UTC &middot; the whole demo took "
       << fmt::format("{:.0f} s", report.wall_s);
  for (const auto& [what, version] : report.versions) {
    page << " &middot; " << escaped(what) << " " << escaped(version);
  }
  page << "</footer>\n";
}

// A replayed moment in the middle of the first behavior.
std::string posterOf(const DemoReport& report) {
  if (report.behaviors.empty() || report.behaviors.front().key_frames.empty()) return "";
  const auto& frames = report.behaviors.front().key_frames;
  return frames[frames.size() / 2].replay;
}

const BehaviorStory& storyOf(const DemoStory& story, const std::string& name) {
  static const BehaviorStory none;
  for (const BehaviorStory& each : story.behaviors) {
    if (each.name == name) return each;
  }
  return none;
}

}  // namespace

std::string reportHtml(const DemoReport& report, const DemoStory& story) {
  std::ostringstream page;
  const std::string poster = posterOf(report);
  page << "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
          "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>"
       << escaped(story.title) << "</title>\n<style>" << kStyle << "</style>\n</head>\n<body>\n"
       << "<header><div><h1>" << escaped(story.title) << "</h1><p>" << escaped(story.subtitle)
       << "</p></div></header>\n<main>\n<video controls preload=\"metadata\""
       << (poster.empty() ? "" : " poster=\"frames/" + escaped(poster) + ".png\"") << " src=\""
       << escaped(report.video) << "\">The video " << escaped(report.video)
       << " shows the room as a bystander sees it.</video>\n";
  for (const MeasuredBehavior& each : report.behaviors) {
    writeBehavior(page, each, storyOf(story, each.behavior.name));
  }
  writeMeasurements(page, report);
  writeInStep(page, report);
  writeTryIt(page, report);
  writeFooter(page, report);
  page << "</main>\n</body>\n</html>\n";
  return page.str();
}

}  // namespace afterglow::nodes

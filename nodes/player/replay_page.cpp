#include "nodes/player/replay_page.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "calib/report/html.hpp"
#include "nodes/player/page_numbers.hpp"
#include "nodes/player/replay_plots.hpp"
#include "nodes/player/replay_tables.hpp"
#include "nodes/player/time_plot.hpp"

namespace afterglow::nodes {
namespace {

using calib::element;
using calib::escaped;
using replay::PlayReport;

std::string fact(const std::string& title, const std::string& value, const std::string& remark) {
  return element("div",
                 element("dt", title) + element("dd", value + (remark.empty() ? "" : "<br/>") +
                                                          element("small", escaped(remark))));
}

std::string swatch(const std::string& color, const std::string& words) {
  return element("span", element("i", "style=\"background:" + color + "\"", "") + words);
}

// ------------------------------------------------------------------------------------ the summary

std::string messagesFact(const PlayReport& report) {
  std::uint64_t planned = 0, published = 0, lost = 0;
  for (const auto& [topic, played] : report.topics) {
    if (!topic.isPlayed() || played.replaced > 0) continue;
    planned += topic.count;
    published += played.published;
    lost += played.skipped + played.refused;
  }
  return fact("Sent", std::to_string(published),
              "of " + std::to_string(planned) + " messages" +
                  (lost > 0 ? ", " + std::to_string(lost) + " skipped or refused" : ""));
}

std::string latenessFact(const PlayReport& report) {
  std::int64_t worst = -1;
  std::string topic;
  for (const auto& [planned, played] : report.topics) {
    const std::int64_t p99 = played.lateness.quantile(0.99);
    if (played.lateness.count() == 0 || p99 <= worst) continue;
    worst = p99;
    topic = planned.channel.topic;
  }
  return worst < 0 ? "" : fact("Late, p99", inMilliseconds(worst) + " ms", topic);
}

std::string skewFacts(const PlayReport& report) {
  std::string facts;
  for (const auto& [modality, skew] : report.in_step.skew) {
    facts += fact("Skew to the body, p95",
                  fmt::format("{:.1f} ms", static_cast<double>(skew.size.quantile(0.95)) * 1e-6),
                  std::string(name(modality)));
  }
  return facts;
}

std::string bodyFacts(const PlayReport& report) {
  std::string facts;
  if (const auto base = baseEnd(report)) {
    facts += fact("Base off its end",
                  fmt::format("{:.1f} cm, {:.1f}&#176;", base->distance * 100,
                              base->turn * replay::kDegreesPerRadian),
                  "");
  }
  const auto worst = report.body_end ? worstJoint(*report.body_end) : std::nullopt;
  if (worst)
    facts += fact("Joint farthest off", jointErrorText(worst->first, worst->second, "&#176;"),
                  worst->first);
  return facts;
}

std::string facts(const PlayReport& report) {
  const double took = static_cast<double>(report.actual_ns) * 1e-9;
  const double planned = static_cast<double>(report.planned_ns) * 1e-9;
  std::string all = fact("Took", inSeconds(took), "planned " + inSeconds(planned));
  all += messagesFact(report) + latenessFact(report);
  if (!report.in_step.is_gated) {
    all += fact("Waited", "no", "nothing waited for the body");
  } else if (report.in_step.wait_count > 0) {
    all += fact("Waited", inSeconds(report.in_step.waited_s),
                counted(report.in_step.wait_count, "time") + ", for the body");
  }
  return element("dl", "class=\"facts\"", all + skewFacts(report) + bodyFacts(report));
}

std::string troubles(const PlayReport& report) {
  std::string items;
  for (const auto& [modality, failed] : report.failures) {
    items += element("li",
                     element("strong", std::string(name(modality))) + ": " + escaped(failed.first) +
                         (failed.count > 1 ? " (" + std::to_string(failed.count) + " times)" : ""));
  }
  for (const std::string& note : report.notes) items += element("li", escaped(note));
  if (report.body_end) {
    for (const std::string& remark : report.body_end->remarks) {
      items += element("li", escaped(remark));
    }
  }
  if (report.is_complete && items.empty()) return "";
  const std::string title =
      report.is_complete ? "" : element("h3", "Stopped: " + escaped(report.reason));
  return element("div", report.is_complete ? "class=\"note\"" : "class=\"note bad\"",
                 title + (items.empty() ? "" : element("ul", items)));
}

std::string baseText(const PlayReport& report) {
  if (!report.base) return "";
  const std::string topic = escaped(report.base->topic);
  if (!report.base->driven) {
    return element("p", "The base was driven open loop by " + topic + ": " +
                            escaped(report.base->why_open_loop) + ".");
  }
  const replay::BaseDriveReport& driven = *report.base->driven;
  const replay::DriveSummary summary = summaryOf(driven);
  const std::string text = fmt::format(
      "The base followed its recorded way of {:.2f} m ({}) in {}, at most {:.1f} cm off it, with "
      "{} at the end. Odometry alone would have been off by {:.1f} cm and {:.1f}&#176;. It took {} "
      "longer than recorded.",
      driven.length, escaped(driven.frame), counted(driven.drives.size(), "drive"),
      summary.largest_distance * 100,
      counted(static_cast<std::uint64_t>(summary.corrections), "correction"),
      summary.drift_distance * 100, summary.drift_turn * replay::kDegreesPerRadian,
      inSeconds(driven.delay));
  return element(
      "p", text + (driven.lost.empty() ? "" : " It was given up: " + escaped(driven.lost) + "."));
}

// ------------------------------------------------------------------------------------ the sections

std::string legend(const PlayReport& report) {
  std::string all = swatch("#9aa4af", "recorded");
  for (const replay::Modality modality :
       {replay::Modality::Body, replay::Modality::Ar, replay::Modality::Speech}) {
    const bool is_there =
        std::any_of(report.topics.begin(), report.topics.end(), [&](const auto& topic) {
          return topic.first.isPlayed() && topic.first.modality == modality;
        });
    if (is_there) all += swatch(colorOf(modality), std::string(name(modality)));
  }
  if (!report.in_step.waits.empty()) all += swatch("#fdecc8", "waited for the body");
  return element("div", "class=\"legend\"", all);
}

std::string section(const std::string& title, const std::string& said, const std::string& content) {
  if (content.empty()) return "";
  return element("h2", title) + (said.empty() ? "" : element("p", said)) + content;
}

std::string oneReplay(const PlayReport& report, const std::string& date) {
  const std::string title = "Replay of " + escaped(report.behavior_name) + " (" +
                            std::to_string(report.behavior_id) + ")";
  const std::string under =
      (report.is_complete ? "Completed" : "Stopped") +
      std::string(date.empty() ? "" : " &#183; " + escaped(date)) +
      (report.rate == 1 ? "" : fmt::format(" &#183; at rate {:g}", report.rate)) +
      (report.scheduling.empty() ? "" : " &#183; scheduling " + escaped(report.scheduling));
  const std::string lanes = lanePlot(report);
  return element("h1", title) + element("p", "class=\"under\"", under) + troubles(report) +
         facts(report) +
         section("What was sent when", "", lanes.empty() ? "" : legend(report) + lanes) +
         section("Lateness",
                 "How long after its deadline each message was sent; a wait moves the deadlines.",
                 latenessPlot(report)) +
         section("In step",
                 "How much later than the body light and speech were sent, against the recording.",
                 skewPlot(report) + waitTable(report)) +
         section("The body's end", "",
                 baseText(report) + deviationPlot(report) + jointTable(report)) +
         section("Topics", "", topicTable(report)) +
         section("Not played", "", notPlayedTable(report)) +
         section("Rewritten", "", rewriteTable(report));
}

}  // namespace

std::string replayPage(const std::vector<PlayReport>& reports, const std::string& date) {
  std::string body;
  for (const PlayReport& report : reports) body += oneReplay(report, date);
  const std::string title = reports.size() == 1 ? "Replay of " + reports.front().behavior_name
                                                : std::to_string(reports.size()) + " replays";
  return calib::page(title, body);
}

}  // namespace afterglow::nodes

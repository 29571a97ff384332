#include "nodes/player/replay_tables.hpp"

#include <algorithm>
#include <vector>

#include "calib/report/html.hpp"
#include "nodes/player/page_numbers.hpp"
#include "nodes/player/time_plot.hpp"

namespace afterglow::nodes {
namespace {

using calib::element;
using calib::escaped;
using calib::numberCell;
using replay::PlannedTopic;
using replay::PlayReport;
using replay::TopicReport;

constexpr std::size_t kWaitsShown = 12;

std::string wideTable(const std::string& rows) {
  return element("div", "style=\"overflow-x:auto\"", element("table", rows));
}

/// Titles that begin with a "#" are of numbers.
std::string header(const std::vector<std::string>& titles) {
  std::string row;
  for (const std::string& title : titles) {
    const bool is_number = title[0] == '#';
    row += element("th", is_number ? "class=\"n\"" : "", escaped(title.substr(is_number ? 1 : 0)));
  }
  return element("tr", row);
}

std::string topicRow(const PlannedTopic& topic, const TopicReport& played) {
  const std::string remark = played.replaced > 0
                                 ? counted(played.replaced, "velocity command") +
                                       " replaced: the base was driven along its track"
                                 : played.problem;
  std::string row =
      element("td",
              "style=\"border-left:4px solid " + colorOf(topic.modality) + ";padding-left:8px\"",
              escaped(topic.channel.topic) + (topic.output.topic != topic.channel.topic
                                                  ? " as " + escaped(topic.output.topic)
                                                  : "")) +
      numberCell(std::to_string(played.published) + " / " + plannedText(topic, played));
  for (const double q : {0.5, 0.99, 1.0}) row += numberCell(lateText(played.lateness, q));
  row += numberCell(std::to_string(played.skipped)) + numberCell(std::to_string(played.refused));
  return element("tr", row + element("td", escaped(remark)));
}

}  // namespace

std::string topicTable(const PlayReport& report) {
  std::string rows = header(
      {"Topic", "#Sent / planned", "#Late p50 ms", "#p99", "#Max", "#Skipped", "#Refused", ""});
  for (const auto& [topic, played] : report.topics) {
    if (topic.isPlayed()) rows += topicRow(topic, played);
  }
  return wideTable(rows);
}

std::string notPlayedTable(const PlayReport& report) {
  std::string rows;
  for (const auto& [topic, played] : report.topics) {
    if (topic.isPlayed()) continue;
    rows += element(
        "tr", element("td", escaped(topic.channel.topic)) + element("td", escaped(topic.why_not)));
  }
  return rows.empty() ? "" : wideTable(header({"Topic", "Why"}) + rows);
}

std::string rewriteTable(const PlayReport& report) {
  std::string rows;
  for (const auto& [topic, played] : report.topics) {
    for (const replay::RewrittenField& field : topic.rewrites) {
      if (field.count == 0) continue;
      rows += element("tr", element("td", escaped(topic.channel.topic)) +
                                element("td", escaped(field.path)) +
                                element("td", escaped(std::string(describe(field.rule)))) +
                                numberCell(std::to_string(field.count)));
    }
  }
  return rows.empty() ? ""
                      : wideTable(header({"Topic", "Field", "What was done", "#Times"}) + rows);
}

std::string waitTable(const PlayReport& report) {
  std::vector<replay::PlayWait> waits = report.in_step.waits;
  if (waits.empty()) return "";
  std::stable_sort(waits.begin(), waits.end(),
                   [](const auto& a, const auto& b) { return a.seconds > b.seconds; });
  waits.resize(std::min(waits.size(), kWaitsShown));
  std::string rows = header({"#At", "#Waited", "For"});
  for (const replay::PlayWait& wait : waits) {
    rows +=
        element("tr", numberCell(inSeconds(wait.played_s)) + numberCell(inSeconds(wait.seconds)) +
                          element("td", escaped(wait.what)));
  }
  return element("h3", "style=\"margin-top:20px\"", "The longest waits") + wideTable(rows);
}

std::string jointTable(const PlayReport& report) {
  if (!report.body_end || report.body_end->joints.empty()) return "";
  std::string rows = header({"Joint", "#Off its recorded end"});
  for (const auto& [joint, error] : report.body_end->joints) {
    rows += element(
        "tr", element("td", escaped(joint)) + numberCell(jointErrorText(joint, error, "&#176;")));
  }
  return element("table", "class=\"narrow\"", rows);
}

}  // namespace afterglow::nodes

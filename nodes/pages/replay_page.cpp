#include "nodes/pages/replay_page.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "nodes/pages/page.hpp"
#include "nodes/pages/page_numbers.hpp"
#include "nodes/pages/replay_plots.hpp"
#include "replay/messages/text.hpp"

namespace afterglow::nodes {
namespace {

using replay::kDegreesPerRadian;
using replay::PlannedTopic;
using replay::PlayReport;
using replay::TopicReport;

constexpr std::size_t kWaitsShown = 12;

// ------------------------------------------------------------------------------------ the summary

PageData fact(const std::string& fact_name, const std::string& value, const std::string& remark) {
  return {{"name", fact_name}, {"value", value}, {"remark", remark}};
}

PageData messagesFact(const PlayReport& report) {
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

void addLateness(const PlayReport& report, PageData& facts) {
  std::int64_t worst = -1;
  std::string topic;
  for (const auto& [planned, played] : report.topics) {
    const std::int64_t p99 = played.lateness.quantile(0.99);
    if (played.lateness.count() == 0 || p99 <= worst) continue;
    worst = p99;
    topic = planned.channel.topic;
  }
  if (worst >= 0) facts.push_back(fact("Late, p99", inMilliseconds(worst) + " ms", topic));
}

void addWaits(const replay::InStep& in_step, PageData& facts) {
  if (!in_step.is_gated) {
    facts.push_back(fact("Waited", "no", "nothing waited for the body"));
  } else if (in_step.wait_count > 0) {
    facts.push_back(fact("Waited", inSeconds(in_step.waited_s),
                         replay::counted(in_step.wait_count, "time") + ", for the body"));
  }
  for (const auto& [modality, skew] : in_step.skew) {
    facts.push_back(fact("Skew to the body, p95",
                         fmt::format("{:.1f} ms",
                                     static_cast<double>(skew.size.quantile(0.95)) * 1e-6),
                         std::string(name(modality))));
  }
}

void addEnds(const PlayReport& report, PageData& facts) {
  if (const auto base = baseEnd(report)) {
    facts.push_back(fact(
        "Base off its end",
        fmt::format("{:.1f} cm, {:.1f}°", base->distance * 100, base->turn * kDegreesPerRadian),
        base->doubt.position > 0
            ? fmt::format("± {:.1f} cm, {:.1f}°, as localization errs",
                          base->doubt.position * 100, base->doubt.yaw * kDegreesPerRadian)
            : ""));
  }
  const auto worst = report.body_end ? worstJoint(*report.body_end) : std::nullopt;
  if (worst) {
    const bool is_sliding = report.body_end->sliding.count(worst->first) > 0;
    facts.push_back(fact("Joint farthest off", jointErrorText(is_sliding, worst->second, "°"),
                         worst->first));
  }
}

void addGuards(const PlayReport& report, PageData& facts) {
  if (!report.guards) return;
  const auto ms = [](double patience) { return fmt::format("{:.0f} ms", patience); };
  facts.push_back(fact("Patience of the watchdog", ms(report.guards->patience_ms),
                       fmt::format("this machine was up to {:.1f} ms late",
                                   report.guards->lateness_ms)));
  const auto& on_robot = report.guards->on_robot;
  facts.push_back(on_robot ? fact("Patience of the guard on the robot", ms(on_robot->patience_ms),
                                  on_robot->node + (on_robot->is_afar ? ", over the network" : ""))
                           : fact("Guard on the robot", "none", ""));
}

PageData facts(const PlayReport& report) {
  const double took = static_cast<double>(report.actual_ns) * 1e-9;
  const double planned = static_cast<double>(report.planned_ns) * 1e-9;
  PageData all =
      PageData::array({fact("Took", inSeconds(took), "planned " + inSeconds(planned))});
  all.push_back(messagesFact(report));
  addLateness(report, all);
  addWaits(report.in_step, all);
  addEnds(report, all);
  addGuards(report, all);
  return all;
}

PageData troubles(const PlayReport& report) {
  std::vector<NoticeItem> items;
  for (const auto& [modality, failed] : report.failures) {
    items.push_back(
        {std::string(name(modality)),
         failed.first +
             (failed.count > 1 ? " (" + std::to_string(failed.count) + " times)" : "")});
  }
  for (const std::string& note : report.notes) items.push_back({"", note});
  if (report.body_end) {
    for (const std::string& remark : report.body_end->remarks) items.push_back({"", remark});
  }
  if (report.is_complete && items.empty()) return nullptr;
  return notice(report.is_complete ? "" : "Stopped: " + report.reason, items, !report.is_complete);
}

std::string under(const PlayReport& report, const std::string& date) {
  return (report.is_complete ? "Completed" : "Stopped") +
         std::string(date.empty() ? "" : " · " + date) +
         (report.rate == 1 ? "" : fmt::format(" · at rate {:g}", report.rate)) +
         (report.scheduling.empty() ? "" : " · scheduling " + report.scheduling);
}

// ------------------------------------------------------------------------------------ the sections

PageData longestWaits(const replay::InStep& in_step) {
  std::vector<replay::PlayWait> waits = in_step.waits;
  std::stable_sort(waits.begin(), waits.end(),
                   [](const auto& a, const auto& b) { return a.seconds > b.seconds; });
  waits.resize(std::min(waits.size(), kWaitsShown));
  PageData rows = PageData::array();
  for (const replay::PlayWait& wait : waits) {
    rows.push_back({{"at_s", wait.played_s}, {"seconds", wait.seconds}, {"topic", wait.what}});
  }
  return rows;
}

PageData base(const PlayReport& report) {
  if (!report.base) return nullptr;
  PageData data = {{"topic", report.base->topic}, {"why_open_loop", report.base->why_open_loop}};
  if (!report.base->driven) return data;
  const replay::BaseDriveReport& driven = *report.base->driven;
  const replay::DriveSummary summary = summaryOf(driven);
  data["driven"] = {
      {"length_m", driven.length},
      {"frame", driven.frame},
      {"drives", replay::counted(driven.drives.size(), "drive")},
      {"largest_m", summary.largest_distance},
      {"corrections", replay::counted(static_cast<std::uint64_t>(summary.corrections), "correction")},
      {"drift_m", summary.drift_distance},
      {"drift_deg", summary.drift_turn * kDegreesPerRadian},
      {"delay_s", driven.delay},
      {"lost", driven.lost}};
  return data;
}

PageData joints(const PlayReport& report) {
  PageData rows = PageData::array();
  if (!report.body_end) return rows;
  for (const auto& [joint, error] : report.body_end->joints) {
    const bool is_sliding = report.body_end->sliding.count(joint) > 0;
    rows.push_back({{"joint", joint}, {"error", jointErrorText(is_sliding, error, "°")}});
  }
  return rows;
}

PageData topicRow(const PlannedTopic& topic, const TopicReport& played) {
  const bool is_renamed = topic.output.topic != topic.channel.topic;
  PageData row = {{"topic", topic.channel.topic + (is_renamed ? " as " + topic.output.topic : "")},
                  {"modality", std::string(name(topic.modality))},
                  {"sent", played.published},
                  {"planned", plannedText(topic, played)},
                  {"skipped", played.skipped},
                  {"refused", played.refused},
                  {"remark", played.problem}};
  for (const auto& [key, q] : {std::pair("p50", 0.5), {"p99", 0.99}, {"max", 1.0}}) {
    row[key] = lateText(played.lateness, q);
  }
  if (played.replaced > 0) {
    row["remark"] = replay::counted(played.replaced, "velocity command") +
                    " replaced: the base was driven along its track";
  }
  return row;
}

void addTopics(const PlayReport& report, PageData& data) {
  for (const char* table : {"topics", "not_played", "rewritten"}) data[table] = PageData::array();
  for (const auto& [topic, played] : report.topics) {
    if (!topic.isPlayed()) {
      data["not_played"].push_back({{"topic", topic.channel.topic}, {"why", topic.why_not}});
      continue;
    }
    data["topics"].push_back(topicRow(topic, played));
  }
  for (const auto& [topic, played] : report.topics) {
    for (const replay::RewrittenField& field : topic.rewrites) {
      if (field.count == 0) continue;
      data["rewritten"].push_back({{"topic", topic.channel.topic},
                                   {"field", field.path},
                                   {"rule", std::string(describe(field.rule))},
                                   {"count", field.count}});
    }
  }
}

PageData replayData(const PlayReport& report, const std::string& date) {
  PageData data = {{"title", "Replay of " + report.behavior_name + " (" +
                                 std::to_string(report.behavior_id) + ")"},
                   {"under", under(report, date)},
                   {"troubles", troubles(report)},
                   {"facts", facts(report)},
                   {"lanes", lanePlot(report)},
                   {"lateness", latenessPlot(report)},
                   {"skew", skewPlot(report)},
                   {"waits", longestWaits(report.in_step)},
                   {"base", base(report)},
                   {"deviation", deviationPlot(report)},
                   {"joints", joints(report)}};
  data["has_steps"] = !data["skew"].is_null() || !data["waits"].empty();
  data["has_ends"] =
      !data["base"].is_null() || !data["deviation"].is_null() || !data["joints"].empty();
  addTopics(report, data);
  return data;
}

}  // namespace

std::string replayPage(const std::vector<PlayReport>& reports, const std::string& date) {
  PageData replays = PageData::array();
  for (const PlayReport& report : reports) replays.push_back(replayData(report, date));
  const std::string title = reports.size() == 1 ? "Replay of " + reports.front().behavior_name
                                                : std::to_string(reports.size()) + " replays";
  return makePage("replay.html", {{"page_title", title}, {"replays", replays}});
}

}  // namespace afterglow::nodes

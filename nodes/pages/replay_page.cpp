#include "nodes/pages/replay_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "calib/file_replacement.hpp"
#include "nodes/pages/drawing.hpp"
#include "nodes/pages/page.hpp"
#include "nodes/pages/page_numbers.hpp"
#include "replay/messages/text.hpp"
#include "replay/query/time_text.hpp"

namespace afterglow::nodes {
namespace {

using replay::GoalSpan;
using replay::Modality;
using replay::PlannedTopic;
using replay::PlayReport;
using replay::TopicReport;

constexpr Modality kModalities[] = {Modality::Body, Modality::Ar, Modality::Speech};
constexpr double kLane = 44, kLabel = 18, kRow = 9, kGap = 2;
/// The time without measurement of the base at which the line has a gap: s.
constexpr double kLineGap = 1;
constexpr const char* kRecorded = "recorded";
constexpr double kPlotHeight = 200;
constexpr double kLeastLateMs = 0.001, kLeastTopMs = 1;

std::string lookOf(Modality modality) { return std::string(name(modality)); }

double endOfPlot(const PlayReport& report) {
  double end = static_cast<double>(std::max(report.planned_ns, report.actual_ns)) * 1e-9;
  for (const auto& [planned, topic] : report.topics) {
    for (const replay::Sample& sample : topic.moments.kept()) end = std::max(end, sample.played_s);
  }
  for (const GoalSpan& goal : report.goal_spans) {
    end = std::max(end, goal.played_end_s.value_or(goal.played_begin_s));
  }
  return end;
}

/// Returns where a recorded moment would have been played had nothing waited.
double unhindered(const PlayReport& report, double recorded_s) {
  return (recorded_s - report.begin_s) / report.rate;
}

void shadeWaits(const PlayReport& report, TimePlot& plot) {
  for (const replay::PlayWait& wait : report.in_step.waits) plot.shade(wait.played_s, wait.seconds);
}

std::vector<const std::pair<PlannedTopic, TopicReport>*> lanesOf(const PlayReport& report) {
  std::vector<const std::pair<PlannedTopic, TopicReport>*> lanes;
  for (const Modality modality : kModalities) {
    for (const auto& topic : report.topics) {
      if (topic.first.isPlayed() && topic.first.modality == modality) lanes.push_back(&topic);
    }
  }
  return lanes;
}

/// True if the topic has goals whose ends are known: bars say more than ticks.
bool addGoals(const PlayReport& report, const std::string& topic, double top,
              const std::string& look, TimePlot& plot) {
  bool has_any = false;
  for (const GoalSpan& goal : report.goal_spans) {
    if (goal.topic != topic) continue;
    has_any = true;
    const double begin = unhindered(report, goal.recorded_begin_s);
    plot.bar(begin, goal.recorded_end_s ? unhindered(report, *goal.recorded_end_s) : begin, top,
             kRow, kRecorded);
    plot.bar(goal.played_begin_s, goal.played_end_s.value_or(goal.played_begin_s),
             top + kRow + kGap, kRow, look);
  }
  return has_any;
}

void addLane(const PlayReport& report, const PlannedTopic& planned, const TopicReport& topic,
             double top, TimePlot& plot) {
  const std::string look = lookOf(planned.modality);
  const bool is_driven =
      report.base && report.base->driven && report.base->topic == planned.channel.topic;
  plot.text("soft", plot.x(0) + 6, top + 13, planned.channel.topic);
  plot.text("soft end", TimePlot::kWidth - 20, top + 13,
            is_driven ? "driven along its track"
                      : std::to_string(topic.published) + " of " + std::to_string(planned.count));
  if (addGoals(report, planned.channel.topic, top + kLabel, look, plot)) return;
  const replay::Samples& moments = is_driven ? report.base->deviation : topic.moments;
  std::vector<double> recorded, played;
  for (const replay::Sample& sample : moments.kept()) {
    recorded.push_back(unhindered(report, sample.recorded_s));
    played.push_back(sample.played_s);
  }
  plot.ticks(recorded, top + kLabel, kRow, kRecorded);
  plot.ticks(played, top + kLabel + kRow + kGap, kRow, look);
}

double highest(const replay::Samples& samples) {
  double high = 0;
  for (const replay::Sample& sample : samples.kept()) {
    if (std::isfinite(sample.value)) high = std::max(high, std::abs(sample.value));
  }
  return high;
}

bool isMostlyEarly(const replay::Samples& samples) {
  double sum = 0;
  for (const replay::Sample& sample : samples.kept()) sum += sample.value;
  return sum < 0;
}

PageData plotData(const TimePlot& plot, const PageData& legend = PageData::array()) {
  return {{"drawing", plot.data()}, {"legend", legend}};
}

PageData laneLegend(const PlayReport& report) {
  PageData legend = PageData::array({legendEntry(kRecorded, "recorded")});
  for (const Modality modality : kModalities) {
    const bool is_there =
        std::any_of(report.topics.begin(), report.topics.end(), [&](const auto& topic) {
          return topic.first.isPlayed() && topic.first.modality == modality;
        });
    if (is_there) legend.push_back(legendEntry(lookOf(modality), lookOf(modality)));
  }
  if (!report.in_step.waits.empty()) legend.push_back(legendEntry("wait", "waited for the body"));
  return legend;
}

std::string inMs(double ns) { return fmt::format("{:.3g} ms", ns * 1e-6); }

/// The worst topic of a modality, if any was heard of.
const std::pair<PlannedTopic, TopicReport>* latest(const PlayReport& report, Modality modality) {
  const std::pair<PlannedTopic, TopicReport>* worst = nullptr;
  for (const auto& topic : report.topics) {
    if (topic.first.modality != modality || topic.second.lateness.count() == 0) continue;
    const bool is_worse =
        !worst || topic.second.lateness.quantile(0.99) > worst->second.lateness.quantile(0.99);
    if (is_worse) worst = &topic;
  }
  return worst;
}

}  // namespace

PageData lanePlot(const PlayReport& report) {
  const auto lanes = lanesOf(report);
  if (lanes.empty()) return nullptr;
  TimePlot plot(endOfPlot(report), kLane * static_cast<double>(lanes.size()),
                "What was recorded and what was sent, topic by topic");
  shadeWaits(report, plot);
  double top = 0;
  for (const auto* lane : lanes) {
    addLane(report, lane->first, lane->second, top, plot);
    top += kLane;
    if (lane != lanes.back()) plot.rule(top);
  }
  return plotData(plot, laneLegend(report));
}

PageData latenessPlot(const PlayReport& report) {
  double high = kLeastTopMs;
  bool has_any = false;
  for (const auto& [planned, topic] : report.topics) {
    high = std::max(high, highest(topic.moments));
    has_any = has_any || topic.moments.count() > 0;
  }
  if (!has_any) return nullptr;
  TimePlot plot(endOfPlot(report), kPlotHeight, "How late each message was sent");
  shadeWaits(report, plot);
  plot.setLogarithmic(kLeastLateMs, high, "late, ms");
  for (const auto& [planned, topic] : report.topics) {
    plot.dots(topic.moments, lookOf(planned.modality));
  }
  for (const Modality modality : kModalities) {
    const auto* worst = latest(report, modality);
    if (!worst) continue;
    const auto p99 = static_cast<double>(worst->second.lateness.quantile(0.99));
    plot.level(p99 * 1e-6, lookOf(modality),
               "p99 " + inMs(p99) + " on " + worst->first.channel.topic);
  }
  return plotData(plot);
}

PageData skewPlot(const PlayReport& report) {
  double high = 0;
  for (const auto& [modality, skew] : report.in_step.skew) {
    high = std::max(high, highest(skew.samples));
  }
  if (report.in_step.skew.empty()) return nullptr;
  high = std::max(high * 1.1, kLeastTopMs);
  TimePlot plot(endOfPlot(report), kPlotHeight, "How far light and speech were from the body");
  shadeWaits(report, plot);
  plot.setLinear(-high, high, "after the body, ms");
  for (const auto& [modality, skew] : report.in_step.skew) {
    plot.dots(skew.samples, lookOf(modality));
    const auto p95 = static_cast<double>(skew.size.quantile(0.95));
    plot.level(isMostlyEarly(skew.samples) ? -p95 * 1e-6 : p95 * 1e-6, lookOf(modality),
               "p95 " + inMs(p95) + ", " + std::string(name(modality)));
  }
  return plotData(plot);
}

PageData deviationPlot(const PlayReport& report) {
  if (!report.base || report.base->deviation.count() == 0) return nullptr;
  replay::Samples centimeters;
  for (replay::Sample sample : report.base->deviation.kept()) {
    sample.value *= 100;
    centimeters.add(sample);
  }
  TimePlot plot(endOfPlot(report), kPlotHeight, "How far off its recorded way the base was");
  shadeWaits(report, plot);
  plot.setLinear(0, std::max(1.0, highest(centimeters) * 1.1), "off its way, cm");
  plot.line(centimeters, lookOf(Modality::Body), kLineGap);
  return plotData(plot);
}

namespace {

using replay::kDegreesPerRadian;

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
  const auto ms = [](std::int64_t ns) { return fmt::format("{:.1f} ms", 1e-6 * double(ns)); };
  for (const auto& [modality, skew] : in_step.skew) {
    facts.push_back(fact("Skew to the body, p95", ms(skew.size.quantile(0.95)),
                         fmt::format("{}, at most {}", name(modality), ms(skew.size.max()))));
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
  if (report.goals.sent > 0) {
    all.push_back(fact("Goals", std::to_string(report.goals.sent), goalsText(report.goals)));
  }
  addLateness(report, all);
  addWaits(report.in_step, all);
  addEnds(report, all);
  addGuards(report, all);
  return all;
}

/// Returns what went wrong, each with its subject.
std::vector<NoticeItem> failuresOf(const PlayReport& report) {
  std::vector<NoticeItem> items;
  for (const auto& [modality, failed] : report.failures) {
    items.push_back(
        {std::string(name(modality)),
         failed.first +
             (failed.count > 1 ? " (" + std::to_string(failed.count) + " times)" : "")});
  }
  if (report.goals.failed > 0) {
    items.push_back({"goals", replay::counted(report.goals.failed, "goal") + " failed"});
  }
  for (const auto& [topic, played] : report.topics) {
    if (!topic.isPlayed() || played.skipped + played.refused == 0) continue;
    items.push_back({topic.channel.topic,
                     fmt::format("{} skipped, {} refused{}{}", played.skipped, played.refused,
                                 played.problem.empty() ? "" : ": ", played.problem)});
  }
  return items;
}

/// Returns what one should know, and is no failure.
std::vector<NoticeItem> remarksOf(const PlayReport& report) {
  std::vector<NoticeItem> items;
  for (const std::string& note : report.notes) items.push_back({"", note});
  if (report.body_end) {
    for (const std::string& remark : report.body_end->remarks) items.push_back({"", remark});
  }
  return items;
}

/// Returns the first line of a report: whether it went as it was recorded.
PageData verdict(const PlayReport& report, std::size_t failures) {
  if (!report.is_complete) return {{"text", "Stopped: " + report.reason}, {"look", "bad"}};
  if (failures == 0) return {{"text", "Completed, without a failure"}, {"look", "good"}};
  return {{"text", "Completed, with " + replay::counted(failures, "failure")}, {"look", "careful"}};
}

PageData noticeOf(const std::string& heading, const std::vector<NoticeItem>& items, bool is_bad) {
  return items.empty() ? PageData() : notice(heading, items, is_bad);
}

std::string under(const PlayReport& report, const std::string& date) {
  std::vector<std::string> parts;
  if (!date.empty()) parts.push_back(date);
  if (report.rate != 1) parts.push_back(fmt::format("at rate {:g}", report.rate));
  if (!report.scheduling.empty()) parts.push_back("scheduling " + report.scheduling);
  return fmt::format("{}", fmt::join(parts, " · "));
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
  data["driven"] = {{"length_m", driven.length},
                    {"frame", driven.frame},
                    {"drives", replay::counted(driven.drives.size(), "drive")},
                    {"largest_m", summary.largest_distance},
                    {"corrections", replay::counted(static_cast<std::uint64_t>(summary.corrections),
                                                    "correction")},
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
  if (played.problem.empty() && played.published > 0 && !played.was_heard) {
    row["remark"] = "nobody listened";
  }
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
  const std::vector<NoticeItem> failures = failuresOf(report);
  PageData data = {{"title", "Replay of " + report.behavior_name + " (" +
                                 std::to_string(report.behavior_id) + ")"},
                   {"under", under(report, date)},
                   {"verdict", verdict(report, failures.size())},
                   {"failures", noticeOf("What failed", failures, true)},
                   {"remarks", noticeOf("Good to know", remarksOf(report), false)},
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

std::string reportJson(const replay::PlayReport& report, int indent) {
  return toJson(report).dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

void saveReport(const std::string& folder, const replay::PlayReport& report) {
  const std::string now = replay::dateNow();
  std::string compact = now;
  compact.erase(std::remove_if(compact.begin(), compact.end(),
                               [](char letter) { return letter == '-' || letter == ':'; }),
                compact.end());
  const std::string name = folder + "/" + std::to_string(report.behavior_id) + "_" + compact;
  std::string free_name = name;
  for (int i = 2; std::filesystem::exists(free_name + ".json"); ++i) {
    free_name = name + "_" + std::to_string(i);
  }
  calib::FileReplacement files;
  files.add(free_name + ".json", reportJson(report, 2) + "\n");
  files.add(free_name + ".html", replayPage({report}, replay::timeText(replay::wallNow())));
  files.commit();
}

}  // namespace afterglow::nodes

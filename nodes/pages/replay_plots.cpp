#include "nodes/pages/replay_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "nodes/pages/time_plot.hpp"

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

}  // namespace afterglow::nodes

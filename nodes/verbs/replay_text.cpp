#include "nodes/verbs/replay_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "nodes/pages/page_numbers.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/messages/text.hpp"

namespace afterglow::nodes {
namespace {

using replay::PlannedTopic;
using replay::PlayReport;
using replay::TopicReport;

std::string ms(std::int64_t ns) { return fmt::format("{:.1f}", static_cast<double>(ns) * 1e-6); }

std::string degrees(double radians) {
  return fmt::format("{:.1f} deg", radians * replay::kDegreesPerRadian);
}

std::string centimeters(double meters) { return fmt::format("{:.1f} cm", meters * 100); }

/// Within a line's words.
const std::string kNextLine = "\n" + std::string(11, ' ');

/// A line with its subject in front; none for no words.
std::string line(std::string subject, const std::string& words) {
  subject.resize(11, ' ');
  return words.empty() ? "" : subject + words + "\n";
}

std::string headline(const PlayReport& report) {
  const double took = static_cast<double>(report.actual_ns) * 1e-9;
  const double planned = static_cast<double>(report.planned_ns) * 1e-9;
  return "behavior " + std::to_string(report.behavior_id) + " '" + report.behavior_name + "' " +
         (report.is_complete ? "was replayed in " : "was stopped after ") + inSeconds(took) +
         ", planned " + inSeconds(planned) + "\n";
}

std::string topics(const PlayReport& report) {
  using Align = TextTable::Align;
  TextTable table({{"sent", Align::Right},
                   {"of", Align::Right},
                   {"late p50", Align::Right},
                   {"p99", Align::Right},
                   {"max ms", Align::Right},
                   {"topic", Align::Left}});
  for (const auto& [topic, played] : report.topics) {
    if (!topic.isPlayed()) continue;
    const bool is_renamed = topic.output.topic != topic.channel.topic;
    table.add({std::to_string(played.published), plannedText(topic, played),
               lateText(played.lateness, 0.5), lateText(played.lateness, 0.99),
               lateText(played.lateness, 1),
               topic.channel.topic + (is_renamed ? " as " + topic.output.topic : "")});
  }
  return table.text("  ");
}

/// What did not go out as it was recorded, topic by topic.
std::string losses(const PlayReport& report) {
  std::string text;
  for (const auto& [topic, played] : report.topics) {
    const std::string where = " on " + topic.channel.topic + ": ";
    const auto tell = [&](const char* what, std::uint64_t count, const std::string& why) {
      if (count > 0) text += line(what, std::to_string(count) + where + why);
    };
    if (played.replaced == 0 && played.published > topic.count) {
      tell("repeated", played.published - topic.count, "sent again, as a seek wants it");
    }
    tell("replaced", played.replaced, "the base was driven along its track");
    tell("skipped", played.skipped, replay::kWhySkipped);
    tell("refused", played.refused, played.problem);
  }
  return text;
}

std::string waits(const replay::InStep& in_step) {
  if (!in_step.is_gated) return "nothing waited for the body";
  if (in_step.waits.empty()) return "";
  const auto longest =
      std::max_element(in_step.waits.begin(), in_step.waits.end(),
                       [](const auto& a, const auto& b) { return a.seconds < b.seconds; });
  return replay::counted(in_step.wait_count, "wait") + ", " + inSeconds(in_step.waited_s) +
         ", the longest " + inSeconds(longest->seconds) + kNextLine + "for " + longest->what;
}

std::string skews(const replay::InStep& in_step) {
  std::string text;
  for (const auto& [modality, skew] : in_step.skew) {
    text += (text.empty() ? "" : kNextLine) + std::string(name(modality)) + " p50 " +
            ms(skew.size.quantile(0.5)) + " p95 " + ms(skew.size.quantile(0.95)) + " max " +
            ms(skew.size.max()) + " ms off the body";
  }
  return text;
}

std::string base(const PlayReport& report) {
  std::string text;
  if (const auto end = baseEnd(report)) {
    const bool is_known = end->doubt.position > 0;
    text = centimeters(end->distance) +
           (is_known ? " +- " + centimeters(end->doubt.position) : "") + " and " +
           degrees(end->turn) + (is_known ? " +- " + degrees(end->doubt.yaw) : "") +
           " off its recorded end";
    if (is_known) {
      text += kNextLine + fmt::format("localization was last renewed {:.1f} m before it",
                                      end->gone_since_localized);
    }
  }
  if (!report.base) return text;
  text += text.empty() ? "" : kNextLine;
  if (!report.base->driven) return text + "open loop: " + report.base->why_open_loop;
  const replay::BaseDriveReport& driven = *report.base->driven;
  const replay::DriveSummary summary = summaryOf(driven);
  return text + "at most " + centimeters(summary.largest_distance) + " off its way of " +
         fmt::format("{:.2f} m", driven.length) + "; odometry drifted " +
         centimeters(summary.drift_distance) + ", " + degrees(summary.drift_turn) +
         (driven.lost.empty() ? "" : kNextLine + "given up: " + driven.lost);
}

std::string guards(const PlayReport& report) {
  if (!report.guards) return "";
  return fmt::format("{}", fmt::join(toText(*report.guards), kNextLine));
}

std::string joints(const PlayReport& report) {
  const auto worst = report.body_end ? worstJoint(*report.body_end) : std::nullopt;
  if (!worst) return "";
  const bool is_sliding = report.body_end->sliding.count(worst->first) > 0;
  return "worst " + jointErrorText(is_sliding, worst->second, " deg") + ", " + worst->first +
         (report.body_end->joints.size() > 1
              ? ", of " + std::to_string(report.body_end->joints.size())
              : "");
}

std::string rewrites(const PlayReport& report) {
  std::map<std::string, std::uint64_t> counts;
  for (const auto& [topic, played] : report.topics) {
    for (const replay::RewrittenField& field : topic.rewrites) {
      if (field.count > 0) counts[std::string(describe(field.rule))] += field.count;
    }
  }
  std::string text;
  for (const auto& [what, count] : counts) {
    text += (text.empty() ? "" : kNextLine) + std::to_string(count) + " " + what;
  }
  return text;
}

}  // namespace

std::string replayText(const PlayReport& report) {
  std::string text = headline(report) + topics(report) + losses(report) +
                     line("goals", goalsText(report.goals)) +
                     line("in step", waits(report.in_step)) + line("skew", skews(report.in_step)) +
                     line("base", base(report)) + line("joints", joints(report)) +
                     line("guards", guards(report)) + line("rewritten", rewrites(report));
  for (const auto& [modality, failed] : report.failures) {
    text += line("failed",
                 std::string(name(modality)) + ": " + failed.first +
                     (failed.count > 1 ? " (" + std::to_string(failed.count) + " times)" : ""));
  }
  return text;
}

std::vector<std::string> replayRemarks(const PlayReport& report) {
  std::vector<std::string> remarks;
  if (report.scheduling != "SCHED_FIFO") remarks.push_back("scheduling was " + report.scheduling);
  remarks.insert(remarks.end(), report.notes.begin(), report.notes.end());
  if (report.body_end) {
    const std::vector<std::string>& unknown = report.body_end->remarks;
    remarks.insert(remarks.end(), unknown.begin(), unknown.end());
  }
  return remarks;
}

}  // namespace afterglow::nodes

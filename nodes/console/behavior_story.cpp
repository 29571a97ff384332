#include "nodes/console/behavior_story.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>

#include "replay/messages/foreign_json.hpp"
#include "replay/query/outcome.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kMostKeyMoments = 6;
constexpr std::size_t kLongestValue = 60;  // bytes
constexpr double kAfterWords_s = 0.5;      // what is said goes with what is shown then

double secondsInto(const replay::Behavior& behavior, replay::Stamp stamp) {
  return static_cast<double>(stamp.ns - behavior.begin.ns) * 1e-9;
}

bool isFailure(const std::string& outcome) {
  return replay::lookOf(outcome) == replay::OutcomeLook::Bad;
}

/// "part: gear, place: 3".
std::string parameterWords(const std::string& parameters) {
  const auto json = replay::parseForeignJson<nlohmann::ordered_json>(parameters);
  std::string words;
  if (!json.is_object()) return words;
  for (const auto& [key, value] : json.items()) {
    std::string text = value.is_string()
                           ? value.get<std::string>()
                           : value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    if (text.size() > kLongestValue) text = text.substr(0, kLongestValue) + "...";
    words += (words.empty() ? "" : ", ") + key + ": " + text;
  }
  return words;
}

StoryEntry entry(double t, const std::string& kind, const std::string& text,
                 const std::string& subject) {
  StoryEntry made;
  made.t = t;
  made.kind = kind;
  made.text = text;
  made.subject = kind + ": " + subject;
  return made;
}

StoryEntry beginOf(const replay::Behavior& behavior) {
  std::string text = "began " + behavior.name;
  if (behavior.attempt > 1) text += fmt::format(", attempt {}", behavior.attempt);
  const std::string words = parameterWords(behavior.parameters);
  if (!words.empty()) text += " (" + words + ")";
  return entry(0, "began", text, text);
}

StoryEntry endOf(const IndexedBehavior& one) {
  const double t = secondsInto(one.behavior, one.end);
  if (!one.behavior.end) return entry(t, "ended", "has no end: it runs, or was cut off", "no end");
  const std::string outcome = one.behavior.outcome.empty() ? "ended" : one.behavior.outcome;
  StoryEntry made = entry(t, "ended", fmt::format("{} after {:.1f} s", outcome, t), outcome);
  made.is_bad = isFailure(one.behavior.outcome);
  return made;
}

StoryEntry goalEntry(const GoalSpan& span) {
  const std::string action = actionName(span.topic);
  const std::string within = span.within.empty() ? "" : ", within " + span.within;
  if (!span.to) {
    return entry(span.from, "goal", action + " was sent a goal; no result was recorded" + within,
                 action + " without result");
  }
  std::string text = fmt::format("{} {} after {:.1f} s{}", action, span.outcome,
                                 *span.to - span.from, within);
  if (!span.remark.empty() && span.outcome != "succeeded") text += ": " + span.remark;
  StoryEntry made = entry(*span.to, "goal", text, action + " " + span.outcome);
  made.is_bad = isFailure(span.outcome);
  return made;
}

StoryEntry childEntry(const replay::Behavior& behavior, const IndexedBehavior& child) {
  const double t = secondsInto(behavior, child.behavior.begin);
  const std::string& told = child.behavior.outcome;
  const std::string outcome = told.empty() ? "no outcome" : told;
  const std::string attempt = child.behavior.attempt > 1
                                  ? fmt::format(" (attempt {})", child.behavior.attempt)
                                  : "";
  StoryEntry made = entry(t, "child",
                          fmt::format("{}{}: {} after {:.1f} s", child.behavior.name, attempt,
                                      outcome, secondsInto(child.behavior, child.end)),
                          child.behavior.name + attempt + " " + outcome);
  made.behavior = child.behavior.id;
  made.is_bad = isFailure(child.behavior.outcome);
  return made;
}

/// Begin and end, and between them what people would look at, no two within a twelfth of it all.
std::vector<double> keyMoments(const std::vector<StoryEntry>& entries, double duration) {
  const double last = std::max(0.0, duration - 1e-3);
  std::vector<double> moments = {0.0};
  const auto add = [&](double t) {
    const bool is_new = std::all_of(moments.begin(), moments.end(), [&](double other) {
      return std::abs(other - t) > duration / 12;
    });
    if (t > 0 && t <= last && is_new && moments.size() < kMostKeyMoments) moments.push_back(t);
  };
  add(last);
  for (const StoryEntry& one : entries) {
    if (one.is_bad) add(one.t);
  }
  for (const StoryEntry& one : entries) {
    if (one.kind == "said") add(one.t + kAfterWords_s);
  }
  for (const StoryEntry& one : entries) add(one.t);
  for (int i = 1; i < 4; ++i) add(duration * i / 4);
  std::sort(moments.begin(), moments.end());
  return moments;
}

}  // namespace

std::string clockText(const replay::Behavior& behavior, double t) {
  const std::int64_t begin =
      behavior.wall_begin.ns != 0 ? behavior.wall_begin.ns : behavior.begin.ns;
  const std::time_t seconds = (begin + static_cast<std::int64_t>(t * 1e9)) / 1'000'000'000;
  std::tm time{};
  localtime_r(&seconds, &time);
  std::array<char, 16> text{};
  std::strftime(text.data(), text.size(), "%H:%M:%S", &time);
  return text.data();
}

ToldStory tellStory(const IndexedBehavior& one, const std::vector<TopicLane>& lanes,
                        const IndexedBehaviors& children) {
  ToldStory story;
  auto& entries = story.entries;
  for (const replay::Utterance& sentence : one.said) {
    entries.push_back(entry(secondsInto(one.behavior, sentence.at), "said",
                            "said \"" + sentence.text + "\"", sentence.text));
  }
  for (const TopicLane& lane : lanes) {
    for (const GoalSpan& span : lane.spans) entries.push_back(goalEntry(span));
  }
  for (const auto& child : children) entries.push_back(childEntry(one.behavior, *child));
  std::stable_sort(entries.begin(), entries.end(),
                   [](const StoryEntry& a, const StoryEntry& b) { return a.t < b.t; });
  entries.insert(entries.begin(), beginOf(one.behavior));
  entries.push_back(endOf(one));
  for (const std::string& remark : one.behavior.remarks) {
    entries.push_back(entry(entries.back().t, "remark", remark, remark));
  }
  for (StoryEntry& made : entries) made.clock = clockText(one.behavior, made.t);
  story.key_moments = keyMoments(entries, secondsInto(one.behavior, one.end));
  return story;
}

}  // namespace afterglow::nodes

#include "nodes/behavior_view/behavior_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "nodes/pages/drawing.hpp"
#include "nodes/pages/page.hpp"
#include "replay/query/outcome.hpp"
#include "replay/query/time_text.hpp"

namespace afterglow::nodes {
namespace {

constexpr double kLaneHeight = 34, kLaneLabel = 18, kLaneRow = 10;  // px

std::string trackTime(double seconds) {
  const auto ms = std::llround(std::max(seconds, 0.0) * 1000);
  return fmt::format("{:02}:{:02}:{:02}.{:03}", ms / 3'600'000, ms / 60'000 % 60, ms / 1000 % 60,
                     ms % 1000);
}

/// WebVTT; a sentence stands until the next one, for as long as it takes to read.
std::string textTrack(const std::vector<replay::Utterance>& said, replay::Stamp begin) {
  std::string track = "WEBVTT\n";
  for (std::size_t i = 0; i < said.size(); ++i) {
    const auto at = [&](std::size_t sentence) {
      return static_cast<double>(said[sentence].at.ns - begin.ns) * 1e-9;
    };
    std::string text;  // without what begins a tag or ends the sentence
    for (const char c : said[i].text) {
      if (c == '<' || c == '&') {
        text += c == '<' ? "&lt;" : "&amp;";
      } else {
        text += c == '\n' || c == '\r' ? ' ' : c;
      }
    }
    double end = at(i) + 2 + 0.06 * static_cast<double>(text.size());
    if (i + 1 < said.size()) end = std::min(end, std::max(at(i + 1), at(i) + 0.1));
    track += fmt::format("\n{} --> {}\n{}\n", trackTime(at(i)), trackTime(end), text);
  }
  return track;
}

/// A look of style.css.
std::string lookOfRole(const std::string& role) {
  const bool is_modality = role == "body" || role == "ar" || role == "speech";
  return is_modality ? role : "recorded";
}

std::vector<const TopicLane*> drawnLanes(const std::vector<TopicLane>& lanes) {
  std::vector<const TopicLane*> drawn;
  for (const char* role : {"body", "ar", "speech", ""}) {
    for (const TopicLane& lane : lanes) {
      const std::string look = lookOfRole(lane.role);
      const bool is_next = look == role || (*role == '\0' && look == "recorded");
      if (is_next && !lane.is_context) drawn.push_back(&lane);
    }
  }
  return drawn;
}

void drawLane(const TopicLane& lane, double top, TimePlot& plot) {
  plot.text("soft", plot.x(0) + 6, top + 13, lane.topic);
  plot.text("soft end", TimePlot::kWidth - 20, top + 13, std::to_string(lane.count));
  if (lane.spans.empty()) {
    return plot.ticks(lane.marks, top + kLaneLabel, kLaneRow, lookOfRole(lane.role));
  }
  for (const GoalSpan& span : lane.spans) {
    plot.bar(span.from, span.to.value_or(span.from), top + kLaneLabel, kLaneRow,
             replay::lookOf(span.outcome) == replay::OutcomeLook::Bad ? "outlier"
                                                                      : lookOfRole(lane.role));
  }
}

PageData timeline(const BehaviorDetail& detail, double duration) {
  const auto lanes = drawnLanes(detail.lanes);
  if (lanes.empty()) return nullptr;
  TimePlot plot(std::max(duration, 0.1), static_cast<double>(lanes.size()) * kLaneHeight,
                "when messages came, topic by topic");
  for (std::size_t i = 0; i < lanes.size(); ++i) {
    if (i > 0) plot.rule(static_cast<double>(i) * kLaneHeight);
    drawLane(*lanes[i], static_cast<double>(i) * kLaneHeight, plot);
  }
  const PageData legend = PageData::array(
      {legendEntry("body", "body"), legendEntry("ar", "ar"), legendEntry("speech", "speech"),
       legendEntry("recorded", "other"), legendEntry("outlier", "a goal that failed")});
  return {{"drawing", plot.data()}, {"legend", legend}};
}

PageData factsOf(const BehaviorDetail& detail, double duration) {
  const replay::Behavior& behavior = detail.behavior;
  PageData facts = PageData::array();
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) facts.push_back({{"name", name}, {"value", value}});
  };
  add("Outcome", behavior.outcome);
  add("Duration", fmt::format("{:.1f} s", duration));
  add("Robot", behavior.robot);
  add("Place in the tree", behavior.tree_path);
  add("Attempt", behavior.attempt > 1 ? std::to_string(behavior.attempt) : "");
  add("Tags", fmt::format("{}", fmt::join(behavior.tags, ", ")));
  add("Messages", std::to_string(detail.summary->messages));
  return facts;
}

/// Shows the projector's image and the room at the key moments.
PageData imagesOf(const BehaviorDetail& detail, const DrawMoment& draw) {
  PageData images = PageData::array();
  if (!draw) return images;
  constexpr std::pair<PictureView, const char*> kViews[] = {
      {PictureView::Projector, "the projector's picture"}, {PictureView::Bystander, "the room"}};
  for (const auto& [view, words] : kViews) {
    try {
      for (const double t : detail.story.key_moments) {
        const MomentJpeg drawn = draw(view, t);
        // The first of a moment's two pictures tells the reasons.
        const bool is_telling = view == PictureView::Projector;
        images.push_back({{"uri", dataUri("image/jpeg", drawn.jpeg)},
                          {"words", fmt::format("{} at {:.1f} s", words, t)},
                          {"dark", is_telling ? drawn.dark : std::vector<std::string>()}});
      }
    } catch (const std::runtime_error&) {  // the others cannot be drawn, either
    }
  }
  return images;
}

}  // namespace

std::string behaviorPage(const BehaviorDetail& detail, const DrawMoment& draw,
                         const std::string& film) {
  const replay::Behavior& behavior = detail.behavior;
  const double duration = static_cast<double>(detail.summary->end.ns - behavior.begin.ns) * 1e-9;
  const std::string title = behavior.name + " (" + std::to_string(behavior.id) + ")";
  PageData data = {{"page_title", title},
                   {"title", title},
                   {"under", "recorded " + replay::timeText(wallBegin(behavior))},
                   {"tells_version", true},
                   {"facts", factsOf(detail, duration)},
                   {"story", PageData::array()},
                   {"images", imagesOf(detail, draw)},
                   {"film", nullptr},
                   {"notes", detail.summary->notes},
                   {"lanes", timeline(detail, duration)}};
  for (const StoryEntry& entry : detail.story.entries) {
    data["story"].push_back(
        {{"t", entry.t}, {"clock", entry.clock}, {"text", entry.text}, {"is_bad", entry.is_bad}});
  }
  if (!film.empty()) {
    data["film"] = {
        {"uri", dataUri("video/mp4", film)},
        {"track", dataUri("text/vtt", textTrack(detail.summary->said, behavior.begin))}};
  }
  return makePage("behavior.html", std::move(data));
}

}  // namespace afterglow::nodes

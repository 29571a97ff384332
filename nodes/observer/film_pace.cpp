#include "nodes/observer/film_pace.hpp"

#include <algorithm>
#include <cmath>

namespace afterglow::nodes {
namespace {

constexpr double kFastest = 4;
constexpr double kBeforeSpeech_s = 0.2, kAfterSpeech_s = 0.6;
constexpr double kStill_s = 0.7;  // shown of what stands still

/// A part of a recording, from where the part before it ends.
struct Part {
  enum class Kind { Said, Moving, Still } kind;
  double until_s;
};

/// Adds what is not said, until a second.
void addUnsaid(const std::vector<FilmSpan>& moving, double until_s, std::vector<Part>& parts) {
  const double begin_s = parts.empty() ? 0 : parts.back().until_s;
  double from_s = begin_s;
  for (const FilmSpan& span : moving) {
    if (span.end_s <= from_s || span.begin_s >= until_s) continue;
    if (span.begin_s > from_s + kStill_s) parts.push_back({Part::Kind::Still, span.begin_s});
    from_s = std::min(span.end_s, until_s);
    parts.push_back({Part::Kind::Moving, from_s});
  }
  if (until_s > from_s + kStill_s) parts.push_back({Part::Kind::Still, until_s});
  if (until_s > from_s) parts.push_back({Part::Kind::Moving, until_s});
}

std::vector<Part> partsOf(const FilmEvents& events) {
  std::vector<Part> parts;
  for (const FilmSpan& span : events.said) {
    const double from_s = parts.empty() ? 0 : parts.back().until_s;
    const double begin_s = std::clamp(span.begin_s - kBeforeSpeech_s, from_s, events.seconds);
    addUnsaid(events.moving, begin_s, parts);
    const double end_s = std::clamp(span.end_s + kAfterSpeech_s, begin_s, events.seconds);
    parts.push_back({Part::Kind::Said, end_s});
  }
  addUnsaid(events.moving, events.seconds, parts);
  return parts;
}

}  // namespace

double ClockPair::secondAt(double first_s) const {
  if (moments_.empty()) return first_s;
  const auto after = std::find_if(moments_.begin(), moments_.end(),
                                  [&](const auto& moment) { return moment.first >= first_s; });
  if (after == moments_.begin() || after == moments_.end()) {
    const auto& nearest = after == moments_.end() ? moments_.back() : *after;
    return nearest.second + first_s - nearest.first;
  }
  const auto& [a, a_second] = *(after - 1);
  const auto& [b, b_second] = *after;
  return a_second + (b_second - a_second) * (first_s - a) / (b - a);
}

double ClockPair::firstAt(double second_s) const {
  ClockPair turned;
  for (const auto& [first_s, at_s] : moments_) {
    const bool is_standing = turned.isKnown() && at_s <= turned.moments_.back().first;
    if (!is_standing) turned.add(at_s, first_s);
  }
  return turned.secondAt(second_s);
}

ClockPair filmPace(const FilmEvents& events, double most_s) {
  ClockPair clocks;
  clocks.add(0, 0);
  if (std::isinf(most_s)) return clocks;
  const std::vector<Part> parts = partsOf(events);
  double own_s = 0, moving_s = 0, begin_s = 0;  // at its own pace, and what may be faster
  for (const Part& part : parts) {
    const double length_s = part.until_s - begin_s;
    if (part.kind == Part::Kind::Moving) moving_s += length_s;
    if (part.kind == Part::Kind::Said) own_s += length_s;
    if (part.kind == Part::Kind::Still) own_s += kStill_s;
    begin_s = part.until_s;
  }
  const double pace = std::clamp(moving_s / std::max(1e-3, most_s - own_s), 1.0, kFastest);
  double film_s = begin_s = 0;
  for (const Part& part : parts) {
    const double length_s = part.until_s - begin_s;
    if (length_s <= 0) continue;
    film_s += part.kind == Part::Kind::Still    ? kStill_s
              : part.kind == Part::Kind::Moving ? length_s / pace
                                                : length_s;
    clocks.add(film_s, begin_s = part.until_s);
  }
  return clocks;
}

}  // namespace afterglow::nodes

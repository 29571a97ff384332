#include "replay/play/goal_remainder.hpp"

#include <algorithm>
#include <utility>

#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {
namespace {

/// Time for the last point of a trajectory that had run out when it was interrupted: it only has to
/// be settled on.
constexpr std::int64_t kSettleNs = 200'000'000;

Value* find(Value& message, const std::string& name) {
  if (Object* object = std::get_if<Object>(&message)) {
    for (auto& [key, value] : *object) {
      if (key == name) return &value;
    }
  }
  return nullptr;
}

Array* trajectoryPoints(Value& document) {
  Value* at = &document;
  for (const char* name : {"goal", "trajectory", "points"}) {
    at = find(*at, name);
    if (!at) return nullptr;
  }
  return std::get_if<Array>(at);
}

RosDuration* timeFromStart(Value& point) {
  Value* field = find(point, "time_from_start");
  return field ? std::get_if<RosDuration>(field) : nullptr;
}

std::int64_t nanoseconds(RosDuration duration) {
  return std::int64_t{duration.sec} * 1'000'000'000 + duration.nsec;
}

RosDuration toDuration(std::int64_t ns) {
  return {static_cast<std::int32_t>(ns / 1'000'000'000),
          static_cast<std::int32_t>(ns % 1'000'000'000)};
}

void dropPassed(Array& points, std::int64_t elapsed_ns) {
  const auto has_passed = [&](Value& point) {
    const RosDuration* time = timeFromStart(point);
    return time && nanoseconds(*time) <= elapsed_ns;
  };
  const auto first = std::find_if_not(points.begin(), points.end(), has_passed);
  const bool is_over = first == points.end();
  points.erase(points.begin(), is_over ? std::prev(points.end()) : first);
  for (Value& point : points) {
    if (RosDuration* time = timeFromStart(point)) {
      *time = toDuration(is_over ? kSettleNs : nanoseconds(*time) - elapsed_ns);
    }
  }
}

}  // namespace

Bytes remainderOfGoal(const Channel& channel, const Bytes& goal, std::int64_t elapsed_ns) {
  const Schema schema = Schema::parse(channel.type, channel.definition);
  Value document = decode(schema, goal);
  Array* points = trajectoryPoints(document);
  if (!points || points->empty()) {
    return goal;
  }
  dropPassed(*points, elapsed_ns);
  return encode(schema, document);
}

}  // namespace afterglow::replay

#include "replay/play/goal_remainder.hpp"

#include <algorithm>
#include <utility>

#include "replay/messages/schema.hpp"

namespace afterglow::replay {
namespace {

/// Time for the last point of a trajectory that had run out when it was interrupted: it only has to
/// be settled on.
constexpr std::int64_t kSettleNs = 200'000'000;

template <typename AnyValue>
auto* fieldOf(AnyValue& message, const std::string& field) {
  using Found = std::conditional_t<std::is_const_v<AnyValue>, const Value, Value>;
  if (auto* object = std::get_if<Object>(&message)) {
    for (auto& [key, value] : *object) {
      if (key == field) return static_cast<Found*>(&value);
    }
  }
  return static_cast<Found*>(nullptr);
}

RosDuration toDuration(std::int64_t ns) {
  return {static_cast<std::int32_t>(ns / 1'000'000'000),
          static_cast<std::int32_t>(ns % 1'000'000'000)};
}

void dropPassed(Array& points, std::int64_t elapsed_ns, std::int64_t lead_ns) {
  const auto first = std::find_if_not(points.begin(), points.end(), [&](const Value& point) {
    return timeFromStartNs(point) <= elapsed_ns;
  });
  const bool is_over = first == points.end();
  points.erase(points.begin(), is_over ? std::prev(points.end()) : first);
  for (Value& point : points) {
    if (Value* time = fieldOf(point, "time_from_start")) {
      *time = toDuration(is_over ? std::max(kSettleNs, lead_ns)
                                 : timeFromStartNs(point) - elapsed_ns + lead_ns);
    }
  }
}

}  // namespace

std::optional<Trajectory> trajectoryIn(Value& document) {
  Value* trajectory = &document;
  if (Value* goal = fieldOf(document, "goal")) {
    trajectory = fieldOf(*goal, "trajectory");
  }
  Value* names = trajectory ? fieldOf(*trajectory, "joint_names") : nullptr;
  Value* points = trajectory ? fieldOf(*trajectory, "points") : nullptr;
  if (!names || !points || !std::get_if<Array>(names) || !std::get_if<Array>(points)) {
    return std::nullopt;
  }
  Trajectory found{{}, &std::get<Array>(*points)};
  for (const Value& joint : std::get<Array>(*names)) {
    if (const auto* text = std::get_if<std::string>(&joint)) found.joints.push_back(*text);
  }
  return found;
}

std::int64_t timeFromStartNs(const Value& point) {
  const Value* time = fieldOf(point, "time_from_start");
  const RosDuration* duration = time ? std::get_if<RosDuration>(time) : nullptr;
  return duration ? std::int64_t{duration->sec} * 1'000'000'000 + duration->nsec : 0;
}

Bytes remainderOfGoal(const Channel& channel, const Bytes& goal, std::int64_t elapsed_ns,
                      std::int64_t lead_ns) {
  const Schema schema = Schema::parse(channel.type, channel.definition);
  Value document = decode(schema, goal);
  const auto trajectory = trajectoryIn(document);
  if (!trajectory || trajectory->points->empty()) {
    return goal;
  }
  dropPassed(*trajectory->points, elapsed_ns, lead_ns);
  return encode(schema, document);
}

Bytes haltedTrajectory(const Channel& channel, const Bytes& command) {
  const Schema schema = Schema::parse(channel.type, channel.definition);
  Value document = decode(schema, command);
  if (const auto trajectory = trajectoryIn(document)) trajectory->points->clear();
  return encode(schema, document);
}

}  // namespace afterglow::replay

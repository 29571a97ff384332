#include "replay/motion/goal_remainder.hpp"

#include <algorithm>

#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {
namespace {

/// Time for the last point of a trajectory that had run out when it was interrupted: it only has to
/// be settled on.
constexpr std::int64_t kSettleNs = 200'000'000;

void dropPassed(Array& points, std::int64_t elapsed_ns, std::int64_t lead_ns) {
  const auto first = std::find_if_not(points.begin(), points.end(), [&](const Value& point) {
    return timeFromStartNs(point) <= elapsed_ns;
  });
  const bool is_over = first == points.end();
  points.erase(points.begin(), is_over ? std::prev(points.end()) : first);
  for (Value& point : points) {
    if (Value* time = findValue(point, "time_from_start")) {
      *time = toRosDuration(is_over ? std::max(kSettleNs, lead_ns)
                                 : timeFromStartNs(point) - elapsed_ns + lead_ns);
    }
  }
}

}  // namespace

std::optional<Trajectory> trajectoryIn(Value& document) {
  Value* trajectory = &document;
  if (Value* goal = findValue(document, "goal")) {
    trajectory = findValue(*goal, "trajectory");
  }
  Value* names = trajectory ? findValue(*trajectory, "joint_names") : nullptr;
  Value* points = trajectory ? findValue(*trajectory, "points") : nullptr;
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
  const Value* time = findValue(point, "time_from_start");
  const RosDuration* duration = time ? std::get_if<RosDuration>(time) : nullptr;
  return duration ? std::int64_t{duration->sec} * 1'000'000'000 + duration->nsec : 0;
}

double secondsOf(const Value& point) { return static_cast<double>(timeFromStartNs(point)) * 1e-9; }

Bytes remainderOfGoal(const Channel& channel, const Bytes& goal, std::int64_t elapsed_ns,
                      std::int64_t lead_ns) {
  const Schema schema = Schema::of(channel);
  Value document = decode(schema, goal);
  const auto trajectory = trajectoryIn(document);
  if (!trajectory || trajectory->points->empty()) {
    return goal;
  }
  dropPassed(*trajectory->points, elapsed_ns, lead_ns);
  return encode(schema, document);
}

Bytes haltedTrajectory(const Channel& channel, const Bytes& command) {
  const Schema schema = Schema::of(channel);
  Value document = decode(schema, command);
  if (const auto trajectory = trajectoryIn(document)) trajectory->points->clear();
  return encode(schema, document);
}

bool isHeadGoal(const Channel& channel) {
  return channel.type == "control_msgs/PointHeadActionGoal" ||
         channel.type == "pr2_controllers_msgs/PointHeadActionGoal";
}

std::int64_t shortestDurationNs(const Channel& channel, const Bytes& goal) {
  const Value document = decode(Schema::of(channel), goal);
  const Value* value = findValue(document, "goal.min_duration");
  const RosDuration* duration = value ? std::get_if<RosDuration>(value) : nullptr;
  return duration ? std::int64_t{duration->sec} * 1'000'000'000 + duration->nsec : 0;
}

Bytes noFaster(const Channel& channel, const Bytes& head_goal, double velocity) {
  const Schema schema = Schema::of(channel);
  Value document = decode(schema, head_goal);
  Value& value = valueAt(document, "goal.max_velocity");
  const auto* own = std::get_if<double>(&value);
  // 0, or what is no number: as fast as the controller lets it.
  value = own && *own > 0 ? std::min(*own, velocity) : velocity;
  return encode(schema, document);
}

Bytes presentGaze(const Channel& channel, const Bytes& goal, const std::string& gaze_frame,
                  const std::string& goal_id) {
  constexpr double kFarAhead = 1000;  // m: where the frame's origin lies does not matter
  constexpr std::int64_t kDuration = 100'000'000;
  const Schema schema = Schema::of(channel);
  Value document = decode(schema, goal);
  for (const char* stamp : {"header.stamp", "goal_id.stamp", "goal.target.header.stamp"}) {
    valueAt(document, stamp) = RosTime{};
  }
  valueAt(document, "goal_id.id") = goal_id;
  valueAt(document, "goal.target.header.frame_id") = gaze_frame;
  valueAt(document, "goal.target.point.x") = kFarAhead;
  valueAt(document, "goal.target.point.y") = 0.0;
  valueAt(document, "goal.target.point.z") = 0.0;
  valueAt(document, "goal.min_duration") = toRosDuration(kDuration);
  return encode(schema, document);
}

}  // namespace afterglow::replay

#include "replay/motion/start_pose.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>

#include "replay/messages/document.hpp"
#include "replay/motion/track_reader.hpp"
#include "replay/play/goal_remainder.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
/// Joint states come many times a second; what is older may not be so any more.
constexpr std::int64_t kBefore = 5 * kSecond, kAfter = kSecond;

const std::string kNotLocalized = "it was recorded without localization (map -> odom)";

template <typename... Arguments>
std::string formatted(const char* format, Arguments... arguments) {
  char text[160];
  std::snprintf(text, sizeof(text), format, arguments...);
  return text;
}

bool contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

Value* find(Value& message, const std::string& path) {
  auto* object = std::get_if<Object>(&message);
  const std::size_t dot = path.find('.');
  if (!object) return nullptr;
  for (auto& [name, value] : *object) {
    if (name == path.substr(0, dot)) {
      return dot == std::string::npos ? &value : find(value, path.substr(dot + 1));
    }
  }
  return nullptr;
}

Value& field(Value& message, const std::string& path) {
  if (Value* found = find(message, path)) return *found;
  throw MessageError("no field " + path);
}

std::vector<double> numbersOf(const Value& value) {
  const auto* array = std::get_if<NumberArray>(&value);
  std::vector<double> numbers;
  if (array && array->type == FieldType::Float64) {
    numbers.resize(array->size());
    if (!numbers.empty()) std::memcpy(numbers.data(), array->bytes.data(), array->bytes.size());
  }
  return numbers;
}

NumberArray numberArray(const std::vector<double>& numbers) {
  NumberArray array{FieldType::Float64, Bytes(numbers.size() * sizeof(double))};
  if (!numbers.empty()) std::memcpy(array.bytes.data(), numbers.data(), array.bytes.size());
  return array;
}

bool isGripperGoal(const Channel& channel) {
  return channel.type == "control_msgs/GripperCommandActionGoal";
}

void addGoal(const PlannedTopic& topic, const Bytes& bytes, const Schema& schema,
             std::optional<JointGoals>& goals) {
  Value document = decode(schema, bytes);
  std::vector<std::string> joints;
  if (const auto trajectory = trajectoryIn(document)) {
    joints = trajectory->joints;
  } else if (!isGripperGoal(topic.channel)) {
    return;
  }
  if (!goals) goals = JointGoals{topic.output, bytes, {}};
  for (const std::string& joint : joints) {
    if (std::count(goals->joints.begin(), goals->joints.end(), joint) == 0) {
      goals->joints.push_back(joint);
    }
  }
}

std::optional<JointGoals> readGoals(const Store& store, const PlayPlan& plan,
                                    const PlannedTopic& topic) {
  std::optional<JointGoals> goals;
  const Schema schema = Schema::parse(topic.channel.type, topic.channel.definition);
  const auto cursor = store.messages(plan.behavior, {{topic.channel.topic}, plan.begin, plan.end});
  while (const auto message = cursor->next()) {
    try {
      addGoal(topic, message->bytes, schema, goals);
    } catch (const MessageError&) {
      continue;
    }
  }
  return goals;
}

/// The behavior with what its recording has around the moment.
Behavior widened(const PlayPlan& plan, Stamp at) {
  Behavior wide = plan.behavior;
  wide.begin = {at.ns - kBefore};
  wide.end = Stamp{at.ns + kAfter};
  return wide;
}

/// Positions of joints up to a moment, or the first after it.
class JointReading {
 public:
  explicit JointReading(Stamp at) : at_(at) {}

  void add(const Schema& schema, const Message& message) {
    Value document = decode(schema, message.bytes);
    const auto* names = std::get_if<Array>(&field(document, "name"));
    const std::vector<double> positions = numbersOf(field(document, "position"));
    for (std::size_t i = 0; names && i < std::min(names->size(), positions.size()); ++i) {
      const auto* name = std::get_if<std::string>(&(*names)[i]);
      const bool is_known = name && joints.count(*name) > 0;
      if (name && std::isfinite(positions[i]) && !(is_known && message.received > at_)) {
        joints[*name] = positions[i];
      }
    }
  }

  std::map<std::string, double> joints;

 private:
  Stamp at_;
};

std::map<std::string, double> readJoints(const Store& store, const PlayPlan& plan, Stamp at) {
  const Behavior wide = widened(plan, at);
  std::vector<std::string> topics;
  for (const auto& known : {store.topics(wide), store.contextTopics(wide)}) {
    for (const TopicSummary& topic : known) {
      if (topic.type == "sensor_msgs/JointState") topics.push_back(topic.topic);
    }
  }
  JointReading reading(at);
  if (topics.empty()) return {};
  const auto cursor = store.messages(wide, {topics});
  while (const auto message = cursor->next()) {
    try {
      const Channel channel = store.channel(message->channel);
      reading.add(Schema::parse(channel.type, channel.definition), *message);
    } catch (const MessageError&) {
      continue;
    }
  }
  return reading.joints;
}

/// Of the moved parts.
std::map<std::string, double> movedJoints(const Store& store, const PlayPlan& plan,
                                          const MovedParts& parts, Stamp at, const char* when,
                                          std::vector<std::string>& remarks) {
  std::map<std::string, double> moved;
  const std::map<std::string, double> recorded = readJoints(store, plan, at);
  for (const std::string& joint : parts.joints()) {
    const auto found = recorded.find(joint);
    if (found != recorded.end()) {
      moved.insert(*found);
    } else {
      remarks.push_back("the position of " + joint + " " + when + " was not recorded");
    }
  }
  for (const auto& [joint, position] : recorded) {
    if (parts.movesGripper() && isGripperJoint(joint)) moved.emplace(joint, position);
  }
  return moved;
}

std::optional<PlanarPose> readBase(const Store& store, const PlayPlan& plan,
                                   const TrackFrames& frames, std::vector<std::string>& remarks) {
  std::string why;
  const auto track =
      readPoseTrack(store, widened(plan, plan.begin), frames, LocalizationNoise(), why);
  if (track && track->isLocalized()) {
    return track->at(plan.begin);
  }
  remarks.push_back("where the base stood at the start is not known: " +
                    (track ? kNotLocalized : why));
  return std::nullopt;
}

double toleranceOf(const std::string& joint, const StartTolerances& tolerances) {
  return isGripperJoint(joint)   ? tolerances.gripper
         : isSlidingJoint(joint) ? tolerances.sliding
                                 : tolerances.turning;
}

/// The gap is what both fingers leave open.
double gap(const StartPose& pose) {
  double sum = 0;
  for (const auto& [joint, position] : pose.joints) {
    if (isGripperJoint(joint)) sum += position;
  }
  return sum;
}

/// To be there, standing, after so long.
Value endPoint(const Value& like, const std::vector<double>& positions, double seconds) {
  Value point = like;
  field(point, "positions") = numberArray(positions);
  field(point, "velocities") = numberArray(std::vector<double>(positions.size()));
  field(point, "accelerations") = numberArray({});
  field(point, "effort") = numberArray({});
  const double whole = std::floor(seconds);
  field(point, "time_from_start") = RosDuration{static_cast<std::int32_t>(whole),
                                                static_cast<std::int32_t>((seconds - whole) * 1e9)};
  return point;
}

/// False if a position is not known, or all are what they should be.
bool aimTrajectory(Value& goal, const StartPose& then, const StartPose& now,
                   const StartTolerances& tolerances, const ApproachSpeed& speed) {
  const auto trajectory = trajectoryIn(goal);
  if (!trajectory || trajectory->points->empty()) return false;
  double seconds = 1;
  bool deviates = false;
  std::vector<double> positions;
  for (const std::string& joint : trajectory->joints) {
    const auto to = then.joints.find(joint), from = now.joints.find(joint);
    if (to == then.joints.end() || from == now.joints.end()) return false;
    const double way = std::abs(jointError(joint, from->second, to->second));
    deviates = deviates || way > toleranceOf(joint, tolerances);
    seconds = std::max(seconds, way / (isSlidingJoint(joint) ? speed.sliding : speed.turning));
    positions.push_back(to->second);
  }
  const Value like = trajectory->points->front();
  *trajectory->points = {endPoint(like, positions, seconds)};
  field(goal, "goal.trajectory.header.stamp") = RosTime{};
  return deviates;
}

}  // namespace

bool isGripperJoint(const std::string& joint) {
  return contains(joint, "gripper") || contains(joint, "finger");
}

bool isSlidingJoint(const std::string& joint) {
  return contains(joint, "torso") || isGripperJoint(joint);
}

// --------------------------------------------------------------------------------- what it moves

bool MovedParts::movesGripper() const {
  return std::any_of(goals.begin(), goals.end(),
                     [](const JointGoals& goal) { return goal.joints.empty(); });
}

std::vector<std::string> MovedParts::joints() const {
  std::set<std::string> joints;
  for (const JointGoals& goal : goals) joints.insert(goal.joints.begin(), goal.joints.end());
  return {joints.begin(), joints.end()};
}

MovedParts movedParts(const Store& store, const PlayPlan& plan) {
  MovedParts parts;
  for (const PlannedTopic& topic : plan.topics) {
    if (!topic.isPlayed() || topic.modality != Modality::Body) {
      continue;
    }
    if (isVelocity(topic.channel)) {
      parts.moves_base = parts.moves_base || topic.count > 0;
    } else if (auto goals = readGoals(store, plan, topic)) {
      parts.goals.push_back(std::move(*goals));
    }
  }
  return parts;
}

StartPose readStartPose(const Store& store, const PlayPlan& plan, const MovedParts& parts,
                        std::vector<std::string>& remarks, const TrackFrames& frames) {
  StartPose pose;
  pose.joints = movedJoints(store, plan, parts, plan.begin, "at the start", remarks);
  if (parts.moves_base) pose.base = readBase(store, plan, frames, remarks);
  return pose;
}

StartPose readEndPose(const Store& store, const PlayPlan& plan, const MovedParts& parts, Stamp at,
                      std::vector<std::string>& remarks, const TrackFrames& frames) {
  StartPose pose;
  pose.joints = movedJoints(store, plan, parts, at, "at the end", remarks);
  if (!parts.moves_base) return pose;
  std::string why;
  const auto track =
      readPoseTrack(store, plan.behavior, frames, LocalizationNoise(), why, plan.begin, plan.end);
  if (track && track->isLocalized()) {
    pose.base = track->endPose();
  } else {
    remarks.push_back("where the base stood at the end is not known: " +
                      (track ? kNotLocalized : why));
  }
  return pose;
}

// ------------------------------------------------------------------------------------ deviations

double jointError(const std::string& joint, double then, double now) {
  return isSlidingJoint(joint) ? now - then : wrapAngle(now - then);
}

std::vector<std::string> jointDeviations(const StartPose& then, const StartPose& now,
                                         const StartTolerances& tolerances) {
  std::vector<std::string> deviations;
  for (const auto& [joint, position] : then.joints) {
    const auto live = now.joints.find(joint);
    if (live == now.joints.end()) {
      deviations.push_back("nobody tells where " + joint + " is");
      continue;
    }
    const double off = std::abs(jointError(joint, position, live->second));
    if (off > toleranceOf(joint, tolerances)) {
      deviations.push_back(
          joint + formatted(" is %.*f %s off (now %.*f, then %.*f)", isSlidingJoint(joint) ? 3 : 2,
                            off, isSlidingJoint(joint) ? "m" : "rad", isSlidingJoint(joint) ? 3 : 2,
                            live->second, isSlidingJoint(joint) ? 3 : 2, position));
    }
  }
  return deviations;
}

std::string baseDeviation(const StartPose& then, const StartPose& now,
                          const StartTolerances& tolerances) {
  if (!then.base) {
    return "";
  }
  if (!now.base) {
    return "nobody tells where the base is (tf)";
  }
  const PlanarPose way = between(*now.base, *then.base);
  const double off = std::hypot(way.x, way.y), turn = std::abs(way.yaw);
  if (off <= tolerances.base && turn <= tolerances.base_turn) {
    return "";
  }
  return formatted(
      "the base is %.2f m and %.1f deg off (then it stood %.2f m %s and %.2f m to the "
      "%s, turned %.1f deg to the %s)",
      off, turn * kDegreesPerRadian, std::abs(way.x), way.x < 0 ? "behind" : "ahead",
      std::abs(way.y), way.y < 0 ? "right" : "left", turn * kDegreesPerRadian,
      way.yaw < 0 ? "right" : "left");
}

std::optional<Bytes> startGoal(const JointGoals& goals, const StartPose& then, const StartPose& now,
                               const StartTolerances& tolerances, const ApproachSpeed& speed,
                               const std::string& id) {
  if (!isGoal(goals.output)) {
    return std::nullopt;
  }
  const Schema schema = Schema::parse(goals.output.type, goals.output.definition);
  Value goal = decode(schema, goals.first);
  field(goal, "header.stamp") = RosTime{};
  field(goal, "goal_id.stamp") = RosTime{};
  field(goal, "goal_id.id") = id;
  if (isGripperGoal(goals.output)) {
    field(goal, "goal.command.position") = gap(then);
    return std::abs(gap(then) - gap(now)) > tolerances.gripper
               ? std::optional<Bytes>(encode(schema, goal))
               : std::nullopt;
  }
  return aimTrajectory(goal, then, now, tolerances, speed)
             ? std::optional<Bytes>(encode(schema, goal))
             : std::nullopt;
}

}  // namespace afterglow::replay

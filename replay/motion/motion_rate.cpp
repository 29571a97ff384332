#include "replay/motion/motion_rate.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include "replay/messages/wire.hpp"
#include "replay/plan/play_plan.hpp"

namespace afterglow::replay {
namespace {

struct KnownField {
  std::string_view type, field;
  int power;
  double instead_of_0 = 0;
};

/// rad/s, what a head goal's mean velocity is taken for where none is given: a Fetch's controller
/// goes as fast as its joints then, 1.57 rad/s at the peak of its spline.
constexpr double kHeadMean = 0.8;

constexpr KnownField kKnownFields[] = {
    {"geometry_msgs/Twist", "linear", 1},
    {"geometry_msgs/Twist", "angular", 1},
    {"trajectory_msgs/JointTrajectoryPoint", "velocities", 1},
    {"trajectory_msgs/JointTrajectoryPoint", "accelerations", 2},
    {"trajectory_msgs/JointTrajectoryPoint", "time_from_start", -1},
    {"trajectory_msgs/MultiDOFJointTrajectoryPoint", "velocities", 1},
    {"trajectory_msgs/MultiDOFJointTrajectoryPoint", "accelerations", 2},
    {"trajectory_msgs/MultiDOFJointTrajectoryPoint", "time_from_start", -1},
    {"control_msgs/PointHeadGoal", "min_duration", -1},
    {"control_msgs/PointHeadGoal", "max_velocity", 1, kHeadMean},
    {"control_msgs/SingleJointPositionGoal", "min_duration", -1},
    {"control_msgs/SingleJointPositionGoal", "max_velocity", 1},
    {"pr2_controllers_msgs/PointHeadGoal", "min_duration", -1},
    {"pr2_controllers_msgs/PointHeadGoal", "max_velocity", 1, kHeadMean},
    {"pr2_controllers_msgs/SingleJointPositionGoal", "min_duration", -1},
    {"pr2_controllers_msgs/SingleJointPositionGoal", "max_velocity", 1},
    {"ackermann_msgs/AckermannDrive", "steering_angle_velocity", 1},
    {"ackermann_msgs/AckermannDrive", "speed", 1},
    {"ackermann_msgs/AckermannDrive", "acceleration", 2},
    {"ackermann_msgs/AckermannDrive", "jerk", 3},
    {"visualization_msgs/Marker", "lifetime", -1},
};

KnownField knownField(const MessageType& type, const Field& field) {
  for (const KnownField& known : kKnownFields) {
    if (known.type == type.name && known.field == field.name) return known;
  }
  return {"", "", 0};
}

/// A power that is known further out holds for everything within.
void collectScaled(const Schema& schema, std::size_t type_index, const std::string& prefix,
                   int outer_power, std::vector<ScaledField>& found) {
  const MessageType& type = schema.types()[type_index];
  for (const Field& field : type.fields) {
    const KnownField known = knownField(type, field);
    const int power = outer_power != 0 ? outer_power : known.power;
    const std::string path =
        prefix + field.name + (field.arity == Field::Arity::Single ? "" : "[]");
    const bool is_scalable = field.type == FieldType::Float64 || field.type == FieldType::Float32 ||
                             field.type == FieldType::Duration;
    if (field.type == FieldType::Message) {
      collectScaled(schema, field.message, path + ".", power, found);
    } else if (power != 0 && is_scalable) {
      found.push_back({path, power, known.instead_of_0});
    }
  }
}

void scaleDuration(std::uint8_t* at, double factor) {
  std::int32_t parts[2];
  std::memcpy(parts, at, sizeof(parts));
  const double ns = (static_cast<double>(parts[0]) * 1e9 + parts[1]) * factor;
  if (std::abs(ns) > 1e9 * std::numeric_limits<std::int32_t>::max()) {
    throw MessageError("a duration of " + std::to_string(ns * 1e-9) + " s fits no message");
  }
  const std::int64_t whole = std::llround(ns);
  parts[0] = static_cast<std::int32_t>(whole / 1'000'000'000);
  parts[1] = static_cast<std::int32_t>(whole % 1'000'000'000);
  std::memcpy(at, parts, sizeof(parts));
}

void scaleField(const FieldSpan& span, double factor, double instead_of_0, Bytes& bytes) {
  std::uint8_t* at = bytes.data() + span.offset;
  if (span.type == FieldType::Duration) return scaleDuration(at, factor);
  withNumber(span.type, [&](auto type) {
    using Number = decltype(type);
    const auto own = static_cast<double>(loadNumber<Number>(at));
    // At a higher rate it goes as it goes by itself.
    const double number = own == 0 && factor < 1 ? instead_of_0 : own;
    storeNumber(at, static_cast<Number>(number * factor));
  });
}

}  // namespace

std::vector<ScaledField> scaledFields(const Schema& schema, bool has_joint_velocities) {
  std::vector<ScaledField> found;
  collectScaled(schema, 0, "", 0, found);
  for (const Field& field : schema.root().fields) {
    const bool is_data = field.name == "data" && field.type == FieldType::Float64;
    const char* path = field.arity == Field::Arity::Single ? "data" : "data[]";
    if (has_joint_velocities && is_data) found.push_back({path, 1});
  }
  return found;
}

bool hasJointVelocities(const PlannedTopic& topic) {
  const std::string& type = topic.channel.type;
  const bool has_numbers = type == "std_msgs/Float64" || type == "std_msgs/Float64MultiArray";
  // A rule says what stops it, not what its numbers are.
  return has_numbers && topic.rule_stop.kind == StopKind::None &&
         stopOf(topic).kind == StopKind::Zero;
}

std::string whyOnlyAsRecorded(const PlayPlan& plan) {
  for (const PlannedTopic& topic : plan.topics) {
    if (!topic.isPlayed() || !stopOf(topic).isSetPoint()) continue;
    const Schema schema = Schema::of(topic.channel);
    if (scaledFields(schema, hasJointVelocities(topic)).empty()) {
      return topic.channel.topic + ": what of " + topic.channel.type +
             " is a velocity is not known: it is played at rate 1 and without limits only";
    }
  }
  return "";
}

MotionRate::MotionRate(const Schema& schema, bool has_joint_velocities)
    : fields_(scaledFields(schema, has_joint_velocities)) {
  std::vector<FieldPath> paths;
  for (const ScaledField& field : fields_) paths.push_back(FieldPath::parse(field.path));
  if (!paths.empty()) finder_.emplace(schema, paths);
}

void MotionRate::apply(Bytes& bytes, double rate) const {
  if (!finder_ || rate == 1.0) {
    return;
  }
  const auto places = finder_->find(bytes);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double factor = std::pow(rate, fields_[i].power);
    for (const FieldSpan& span : places[i]) {
      scaleField(span, factor, fields_[i].instead_of_0, bytes);
    }
  }
}

}  // namespace afterglow::replay

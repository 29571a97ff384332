#include "replay/plan/motion_stop.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "replay/messages/topic_name.hpp"
#include "replay/messages/wire.hpp"

namespace afterglow::replay {
namespace {

bool isNumberWithSign(FieldType type) {
  return type != FieldType::Bool && isNumber(type) &&
         withNumber(type, [](auto number) { return std::is_signed_v<decltype(number)>; });
}

bool isSpeed(const MessageType& type, const Field& field) {
  return type.name == "ackermann_msgs/AckermannDrive" &&
         (field.name == "speed" || field.name == "acceleration" || field.name == "jerk");
}

/// Returns true if a field of this type can be set to the value.
bool holds(FieldType type, double value) {
  if (type == FieldType::Bool) return value == 0 || value == 1;
  return isNumber(type) && withNumber(type, [value](auto number) {
    using Number = decltype(number);
    if (std::is_floating_point_v<Number>) return true;
    const double least = std::is_signed_v<Number> ? -std::ldexp(1, 8 * sizeof(Number) - 1) : 0;
    const double beyond = std::ldexp(1, std::numeric_limits<Number>::digits);
    return value == std::floor(value) && value >= least && value < beyond;
  });
}

[[noreturn]] void refuse(const MotionStop& stop, const std::string& why) {
  throw std::invalid_argument(stop.rule + (stop.rule.empty() ? "" : ": ") + why);
}

/// "joints[2].speed" is a field of the path "joints[].speed".
std::string withoutIndices(const std::string& path) {
  std::string plain;
  bool is_index = false;
  for (const char letter : path) {
    is_index = is_index && letter != ']';
    if (!is_index) plain += letter;
    is_index = is_index || letter == '[';
  }
  return plain;
}

}  // namespace

std::string describe(const MotionStop& stop) {
  const std::string by = stop.rule.empty() ? "" : " (" + stop.rule + ")";
  switch (stop.kind) {
    case StopKind::None:
      return "nothing stops it that is known";
    case StopKind::Zero:
      return "zeros stop it" + by;
    case StopKind::Speed:
      return "speed 0 stops it, its steering is kept" + by;
    case StopKind::Fields: {
      std::string texts;
      for (const auto& [path, value] : stop.fields) {
        texts += fmt::format("{}{} {:g}", texts.empty() ? "" : ", ", path, value);
      }
      return texts + " stops it" + by;
    }
    case StopKind::NoPoints:
      return "a trajectory without points stops it" + by;
    case StopKind::Cancel:
      return "a cancel " + (stop.cancel_topic.empty() ? "" : "on " + stop.cancel_topic + " ") +
             "stops it" + by;
    case StopKind::EndsItself:
      return "it stops where it is told to go" + by;
    case StopKind::IsStop:
      return "it is a stop itself";
  }
  return "";
}

std::map<std::string, double> stoppingFields(const MotionStop& stop, const Schema& schema) {
  if (stop.kind == StopKind::Fields) return stop.fields;
  std::map<std::string, double> fields;
  if (!stop.isSetPoint()) return fields;
  visitFields(schema, [&](const MessageType& type, const Field& field, const std::string& path) {
    const bool is_meant =
        stop.kind == StopKind::Zero ? isNumberWithSign(field.type) : isSpeed(type, field);
    if (is_meant) fields[path] = 0;
  });
  return fields;
}

void checkStop(const MotionStop& stop, const Schema& schema) {
  const std::string& type_name = schema.root().name;
  std::map<std::string, FieldType> types;
  visitFields(schema, [&](const MessageType&, const Field& field, const std::string& path) {
    types.emplace(path, field.type);
  });
  if (endsWith(type_name, "ActionGoal") && stop.kind != StopKind::Cancel) {
    refuse(stop, "a cancel stops a " + type_name + ", write {cancel: /TOPIC}");
  }
  if (stop.kind == StopKind::Zero && stoppingFields(stop, schema).empty()) {
    refuse(stop, type_name + " has no number to set to zero");
  }
  const bool has_points =
      types.count("joint_names[]") > 0 && types.count("points[].time_from_start") > 0;
  if (stop.kind == StopKind::NoPoints && !has_points) {
    refuse(stop, type_name + " is no trajectory");
  }
  for (const auto& [path, value] : stop.fields) {
    const auto found = types.find(withoutIndices(path));
    if (found == types.end()) refuse(stop, type_name + " has no field " + path);
    if (!holds(found->second, value)) {
      refuse(stop, fmt::format("{} of {} is a {}, which {:g} does not fit", path, type_name,
                               name(found->second), value));
    }
  }
}

}  // namespace afterglow::replay

#include "replay/ros2/field_mapping.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::replay {
namespace {

/// Names that ROS 2 does not allow as they are in ROS 1.
struct Renamed {
  const char* type;
  const char* ros1;
  const char* ros2;
};
constexpr Renamed kRenamed[] = {{"sensor_msgs/CameraInfo", "D", "d"},
                                {"sensor_msgs/CameraInfo", "K", "k"},
                                {"sensor_msgs/CameraInfo", "R", "r"},
                                {"sensor_msgs/CameraInfo", "P", "p"},
                                {"stereo_msgs/DisparityImage", "T", "t"}};

std::string sourceName(const std::string& type, const std::string& field) {
  for (const Renamed& renamed : kRenamed) {
    if (type == renamed.type && field == renamed.ros1) return renamed.ros2;
  }
  return field;
}

/// What is drawn may lack what nothing here draws.
bool isOnlyLookedAt(const std::string& type) {
  return type.compare(0, 19, "visualization_msgs/") == 0;
}

}  // namespace

FieldMapping::FieldMapping(Schema from, Schema to) : from_(std::move(from)), to_(std::move(to)) {
  check(0, 0, "");
}

void FieldMapping::check(std::size_t to_type, std::size_t from_type,
                         const std::string& path) const {
  const MessageType& to = to_.types()[to_type];
  const MessageType& from = from_.types()[from_type];
  for (const Field& field : to.fields) {
    const std::string name = sourceName(to.name, field.name);
    const auto source = std::find_if(from.fields.begin(), from.fields.end(),
                                     [&](const Field& other) { return other.name == name; });
    const std::string here = path + field.name;
    if (source == from.fields.end()) throw MessageError("ROS 2 has no field " + here);
    if (source->type != field.type || source->arity != field.arity ||
        source->length != field.length) {
      throw MessageError("field " + here + " is of another type in ROS 2");
    }
    if (field.type == FieldType::Message) check(field.message, source->message, here + ".");
  }
  if (from.fields.size() == to.fields.size() || isOnlyLookedAt(to.name)) return;
  const auto isExtra = [&](const Field& field) {
    return std::none_of(to.fields.begin(), to.fields.end(), [&](const Field& known) {
      return sourceName(to.name, known.name) == field.name;
    });
  };
  const auto extra = std::find_if(from.fields.begin(), from.fields.end(), isExtra);
  throw MessageError("ROS 1 has no field " + path + extra->name);
}

Value FieldMapping::mapField(Value& from, const Field& field) const {
  if (field.type != FieldType::Message) return std::move(from);
  if (field.arity == Field::Arity::Single) return mapMessage(from, field.message);
  Array elements;
  for (Value& element : std::get<Array>(from)) {
    elements.push_back(mapMessage(element, field.message));
  }
  return elements;
}

Value FieldMapping::mapMessage(Value& from, std::size_t to_type) const {
  const MessageType& to = to_.types()[to_type];
  Object mapped;
  for (const Field& field : to.fields) {
    Value* source = findValue(from, sourceName(to.name, field.name));
    if (!source) throw MessageError(to.name + " lacks field " + field.name);
    mapped.emplace_back(field.name, mapField(*source, field));
  }
  return mapped;
}

Bytes FieldMapping::map(const Bytes& bytes) const {
  Value message = decode(from_, bytes);
  return encode(to_, mapMessage(message, 0));
}

}  // namespace afterglow::replay

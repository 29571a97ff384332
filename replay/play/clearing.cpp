#include "replay/play/clearing.hpp"

#include <string>

#include "replay/messages/document.hpp"
#include "replay/messages/schema.hpp"

namespace afterglow::replay {
namespace {

constexpr std::int32_t kDeleteAll = 3;  // visualization_msgs/Marker

Value& member(Value& message, const std::string& name) {
  for (auto& [key, value] : std::get<Object>(message)) {
    if (key == name) {
      return value;
    }
  }
  throw MessageError("no field " + name);
}

/// All-zero bytes of the least size: numbers 0, strings and arrays empty.
Value blank(const Schema& schema) { return decode(schema, Bytes(schema.minimumSize(0))); }

Value blankWithFrame(const Schema& schema, Value& last) {
  Value message = blank(schema);
  member(member(message, "header"), "frame_id") = member(member(last, "header"), "frame_id");
  return message;
}

Value clearedCloud(Value last) {
  member(member(last, "header"), "stamp") = RosTime{};
  for (const char* size : {"width", "height", "row_step"}) {
    member(last, size) = std::uint32_t{0};
  }
  std::get<NumberArray>(member(last, "data")).bytes.clear();
  return last;
}

Value clearedMarker(const Schema& schema, Value& last) {
  Value marker = blankWithFrame(schema, last);
  member(marker, "action") = kDeleteAll;
  return marker;
}

/// An array of one blank Marker: its count, then zeros of a Marker's least size.
Value clearedMarkers(const Schema& schema) {
  const std::size_t marker_type = schema.root().fields.at(0).message;
  Bytes bytes(sizeof(std::uint32_t) + schema.minimumSize(marker_type));
  bytes[0] = 1;
  Value message = decode(schema, bytes);
  member(std::get<Array>(member(message, "markers")).front(), "action") = kDeleteAll;
  return message;
}

std::optional<Value> cleared(const std::string& type, const Schema& schema, Value last) {
  if (type == "sensor_msgs/PointCloud2") {
    return clearedCloud(std::move(last));
  }
  if (type == "sensor_msgs/LaserScan" || type == "nav_msgs/Path") {
    return blankWithFrame(schema, last);
  }
  if (type == "visualization_msgs/Marker") {
    return clearedMarker(schema, last);
  }
  if (type == "visualization_msgs/MarkerArray") {
    return clearedMarkers(schema);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Bytes> clearingMessage(const Channel& channel, const Bytes& last) {
  try {
    const Schema schema = Schema::parse(channel.type, channel.definition);
    const std::optional<Value> message = cleared(channel.type, schema, decode(schema, last));
    return message ? std::optional<Bytes>(encode(schema, *message)) : std::nullopt;
  } catch (const std::exception&) {  // MessageError, or a type of that name with other fields
    return std::nullopt;
  }
}

}  // namespace afterglow::replay

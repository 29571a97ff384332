/// \file
/// Serialized messages for tests of the core, which knows no ROS: written by their definitions.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "replay/messages/document.hpp"
#include "replay/messages/message.hpp"
#include "replay/messages/schema.hpp"
#include "tests/support/message_definitions.hpp"

namespace afterglow::test {

inline replay::Channel channelOf(const std::string& topic, const std::string& type,
                                 const std::string& definition) {
  return {topic, type, std::string(32, 'a'), definition, false, "/recorded"};
}

inline replay::Channel textChannel(const std::string& topic) {
  return channelOf(topic, topic == "/robotsound" ? "sound_play/SoundRequest" : "std_msgs/String",
                   "string data\n");
}

inline replay::Channel twistChannel(const std::string& topic) {
  return channelOf(topic, "geometry_msgs/Twist",
                   withTypes("Vector3 linear\nVector3 angular\n", "geometry_msgs/Vector3",
                             "float64 x\nfloat64 y\nfloat64 z\n"));
}

inline replay::Channel cloudChannel(const std::string& topic) {
  return channelOf(topic, "sensor_msgs/PointCloud2", kPointCloud2);
}

inline replay::Channel markersChannel(const std::string& topic) {
  return channelOf(topic, "visualization_msgs/MarkerArray",
                   withTypes("Marker[] markers\n", "visualization_msgs/Marker",
                             "Header header\nstring ns\nint32 id\nint32 type\nint32 action\n",
                             "std_msgs/Header", kHeader));
}

inline replay::Channel trajectoryGoalChannel(const std::string& topic) {
  return channelOf(topic, "control_msgs/FollowJointTrajectoryActionGoal", kTrajectoryActionGoal);
}

// ------------------------------------------------------------------------------------ documents

inline replay::Schema schemaOf(const replay::Channel& channel) {
  return replay::Schema::parse(channel.type, channel.definition);
}

/// "goal.trajectory.points"
inline replay::Value& at(replay::Value& message, const std::string& path) {
  const std::size_t dot = path.find('.');
  for (auto& [name, value] : std::get<replay::Object>(message)) {
    if (name == path.substr(0, dot)) {
      return dot == std::string::npos ? value : at(value, path.substr(dot + 1));
    }
  }
  throw std::logic_error("no field " + path);
}

/// A blank element of the message type that the schema lists under this name.
inline replay::Value blank(const replay::Schema& schema, const std::string& type) {
  for (std::size_t i = 0; i < schema.types().size(); ++i) {
    if (schema.types()[i].name == type) {
      replay::Object fields;
      for (const replay::Field& field : schema.types()[i].fields) {
        replay::Value value;
        if (field.type == replay::FieldType::Message) {
          value = blank(schema, schema.types()[field.message].name);
        } else if (field.arity == replay::Field::Arity::DynamicArray) {
          value = replay::NumberArray{field.type, {}};
        } else if (field.type == replay::FieldType::String) {
          value = std::string();
        } else if (field.type == replay::FieldType::Time) {
          value = replay::RosTime{};
        } else if (field.type == replay::FieldType::Duration) {
          value = replay::RosDuration{};
        } else if (field.type == replay::FieldType::Int32) {
          value = std::int32_t{0};
        } else {
          value = std::uint32_t{0};
        }
        fields.emplace_back(field.name, value);
      }
      return fields;
    }
  }
  throw std::logic_error("no type " + type);
}

inline replay::Value blank(const replay::Channel& channel) {
  const replay::Schema schema = schemaOf(channel);
  return replay::decode(schema, replay::Bytes(schema.minimumSize(0)));
}

// ------------------------------------------------------------------------------------- messages

inline replay::Bytes text(const std::string& data) {
  replay::Bytes bytes(4 + data.size());
  bytes[0] = static_cast<std::uint8_t>(data.size());
  std::memcpy(bytes.data() + 4, data.data(), data.size());
  return bytes;
}

inline replay::Bytes twist(double forward) {
  replay::Bytes bytes(48);
  std::memcpy(bytes.data(), &forward, sizeof(forward));
  return bytes;
}

/// So many points of one byte each.
inline replay::Bytes cloud(std::uint32_t points, replay::Stamp stamp = {}) {
  const replay::Channel channel = cloudChannel("/any");
  replay::Value message = blank(channel);
  at(message, "header.frame_id") = std::string("map");
  at(message, "header.stamp") = replay::RosTime{static_cast<std::uint32_t>(stamp.ns / 1000000000),
                                                static_cast<std::uint32_t>(stamp.ns % 1000000000)};
  at(message, "height") = std::uint32_t{1};
  at(message, "width") = points;
  at(message, "data") = replay::NumberArray{replay::FieldType::UInt8, replay::Bytes(points)};
  return replay::encode(schemaOf(channel), message);
}

inline std::uint32_t cloudWidth(const replay::Bytes& bytes) {
  replay::Value message = replay::decode(schemaOf(cloudChannel("/any")), bytes);
  return std::get<std::uint32_t>(at(message, "width"));
}

inline replay::Stamp stampOf(replay::Value& message, const std::string& path) {
  const auto time = std::get<replay::RosTime>(at(message, path));
  return replay::Stamp::fromParts(time.sec, time.nsec);
}

inline replay::Stamp cloudStamp(const replay::Bytes& bytes) {
  replay::Value message = replay::decode(schemaOf(cloudChannel("/any")), bytes);
  return stampOf(message, "header.stamp");
}

inline replay::Bytes markers(int count) {
  const replay::Schema schema = schemaOf(markersChannel("/any"));
  replay::Array array(static_cast<std::size_t>(count), blank(schema, "visualization_msgs/Marker"));
  replay::Value message = replay::Object{{"markers", array}};
  return replay::encode(schema, message);
}

inline std::vector<int> markerActions(const replay::Bytes& bytes) {
  replay::Value message = replay::decode(schemaOf(markersChannel("/any")), bytes);
  std::vector<int> actions;
  for (replay::Value& marker : std::get<replay::Array>(at(message, "markers"))) {
    actions.push_back(std::get<std::int32_t>(at(marker, "action")));
  }
  return actions;
}

/// A trajectory goal with points at these seconds from its start.
inline replay::Bytes goalMessage(const std::string& id, const std::vector<double>& times,
                                 replay::RosTime start = {}) {
  const replay::Schema schema = schemaOf(trajectoryGoalChannel("/any/goal"));
  replay::Value message = blank(trajectoryGoalChannel("/any/goal"));
  at(message, "goal_id.id") = id;
  at(message, "goal_id.stamp") = replay::RosTime{1'600'000'000, 0};
  at(message, "goal.trajectory.header.stamp") = start;
  replay::Array points;
  for (const double time : times) {
    points.push_back(blank(schema, "trajectory_msgs/JointTrajectoryPoint"));
    const auto whole = static_cast<std::int32_t>(std::floor(time));
    at(points.back(), "time_from_start") =
        replay::RosDuration{whole, static_cast<std::int32_t>((time - whole) * 1e9)};
  }
  at(message, "goal.trajectory.points") = points;
  return replay::encode(schema, message);
}

inline std::string goalId(const replay::Bytes& bytes) {
  replay::Value message = replay::decode(schemaOf(trajectoryGoalChannel("/any/goal")), bytes);
  return std::get<std::string>(at(message, "goal_id.id"));
}

inline replay::Stamp trajectoryStamp(const replay::Bytes& bytes) {
  replay::Value message = replay::decode(schemaOf(trajectoryGoalChannel("/any/goal")), bytes);
  return stampOf(message, "goal.trajectory.header.stamp");
}

inline std::vector<double> timesFromStart(const replay::Bytes& bytes) {
  replay::Value message = replay::decode(schemaOf(trajectoryGoalChannel("/any/goal")), bytes);
  std::vector<double> times;
  for (replay::Value& point : std::get<replay::Array>(at(message, "goal.trajectory.points"))) {
    const auto time = std::get<replay::RosDuration>(at(point, "time_from_start"));
    times.push_back(time.sec + time.nsec * 1e-9);
  }
  return times;
}

}  // namespace afterglow::test
